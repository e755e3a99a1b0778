#include "experiments/report/gather.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "datasets/benchmark/sequence.h"
#include "experiments/evaluation/benchmark_sets.h"
#include "experiments/evaluation/evaluation.h"
#include "experiments/pictures/clips.h"
#include "experiments/report/sweep_pictures.h"
#include "experiments/scratch.h"
#include "experiments/sweep/live.h"
#include "experiments/sweep/sweep_dir.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/text.h"
#include "infer/render/page.h"
#include "nn/config/config.h"

namespace restage::report {
namespace {

namespace fs = std::filesystem;
using tables::TrialState;

constexpr size_t kPlayBytes = 6'000'000;  ///< of a sequence's page
constexpr const char* kRanked = "pa_mpjpe";

std::string in(const std::string& folder, const std::string& file) {
  return (fs::path(folder) / file).string();
}

std::string last_part(const std::string& folder) {
  return valid_utf8(fs::path(folder + "/.").lexically_normal().parent_path().filename().string());
}

/// "key: value" a line, of those facts of a provenance.json that are of use to a reader.
std::string provenance_text(const std::string& folder) {
  std::error_code ignored;
  const std::string path = in(folder, "provenance.json");
  if (!fs::exists(path, ignored)) return "";
  // What lies deeper than any run writes is left out: it would be printed by recursion.
  const auto shallow = [](int depth, auto, auto&) { return depth < 16; };
  const auto facts = nlohmann::ordered_json::parse(read_file(path), shallow, false);
  if (!facts.is_object()) return "";
  std::vector<std::vector<std::string>> rows{{"", ""}};
  for (const auto& [key, value] : facts.items()) {
    if (key == "configuration") continue;
    std::string text = tables::plain_text(value);
    if (key == "command_line" && value.is_array()) {
      text.clear();
      for (const auto& word : value) text += (text.empty() ? "" : " ") + tables::plain_text(word);
    }
    rows.push_back({key, text});
  }
  return markdown_table(rows);
}

// ---- playing ------------------------------------------------------------------------------------

/// A prediction as a clip: its surface, or its skeleton without one.
Clip clip_of(const Prediction& made, const std::vector<Triangle>& faces) {
  Clip out;
  out.label = "result";
  out.confidence = made.confidence;
  const bool surface = !made.vertices.empty();
  if (surface) out.faces = faces;
  for (int64_t f = 0; f < made.frames; ++f) {
    const int64_t count = surface ? made.vertex_count : kJoints;
    const double* at = (surface ? made.vertices : made.joints).data() + 3 * count * f;
    if (surface) {
      Points& points = out.frames.emplace_back();
      for (int64_t v = 0; v < count; ++v, at += 3)
        points.push_back(Eigen::Map<const Vec3>(at).cast<float>());
    } else {
      Joints joints;
      for (Vec3& joint : joints) joint = Eigen::Map<const Vec3>(std::exchange(at, at + 3));
      out.frames.push_back(stick_figure(joints));
    }
  }
  return out;
}

Play played(const Bundle& weights, const std::string& folder, const std::string& title,
            uint64_t seed) {
  std::vector<Clip> clips = {read_clip(in(folder, "source.h5"), "source")};
  const Prediction made = retarget_sequence(weights, folder, {.seed = seed, .force = true});
  const Clip truth = read_clip(in(folder, "truth.h5"), "truth");
  clips.push_back(clip_of(made, truth.faces));
  clips.push_back(truth);
  add_errors(truth, &clips[1]);
  PageOptions page;
  page.title = title;
  page.max_bytes = kPlayBytes;
  return {title, page_html(clips, page)};
}

/// Before anything is said or measured.
void check_sequences(const std::vector<std::string>& folders) {
  for (const std::string& folder : folders)
    for (const char* file : {"source.h5", "target.ply", "truth.h5"})
      if (std::error_code ignored; !fs::exists(in(folder, file), ignored))
        throw InputError(folder, std::string("is no sequence's folder (it has no ") + file + ")",
                         "give one of 'restage data build' or 'restage eval --out'");
}

std::vector<Play> played_folders(const Bundle& weights, const GatherOptions& how) {
  std::vector<Play> out;
  for (const std::string& folder : how.sequences)
    out.push_back(played(weights, folder, last_part(folder), how.seed));
  return out;
}

// ---- runs ---------------------------------------------------------------------------------------

/// A finished run, measured.
struct Measured {
  Bundle weights;
  Corpus test;
  EvaluationOptions how;
  std::vector<std::string> names;
  SystemEvaluation scores;
};

/// What is to be measured on, looked at; nothing if there is nothing to measure, and then `why`.
std::optional<Measured> prepared(const std::string& folder, uint64_t seed, std::string* why) {
  std::error_code ignored;
  if (!fs::exists(in(folder, "weights.safetensors"), ignored)) {
    *why = "it is not finished";
    return std::nullopt;
  }
  try {
    TrainConfig config;
    read_config(of_this_version(load_config_tree(in(folder, "config.yaml"))), config);
    Measured out{load_bundle(folder), load_corpus(config.data, "test"), {}, {}, {}};
    out.how = evaluation_options(config, out.test, seed);
    out.names = sequence_names(out.how.sequences, out.test);
    return out;
  } catch (const InputError& error) {  // data that went elsewhere must not hide the curves
    *why = error.what();
    return std::nullopt;
  }
}

void measure(const std::string& folder, Measured* run) {
  log_info(folder + ": measuring on its held-out sequences");
  run->scores = evaluate_system(run->weights, weights_path(folder), run->test, run->how);
}

tables::MetricValues values_of(const metrics::Values& values) {
  tables::MetricValues out;
  for (size_t m = 0; m < values.size(); ++m)
    if (values[m]) out[metrics::table()[m].name] = *values[m];
  return out;
}

tables::Scores scores_of(const metrics::Evaluation& model, const std::vector<std::string>& names) {
  tables::Scores out{values_of(model.mean), {}};
  for (size_t s = 0; s < model.sequences.size(); ++s)
    out.sequences.emplace_back(names[s], values_of(model.sequences[s]));
  return out;
}

tables::TrialResult result_of(const std::string& name, const Measured& run) {
  tables::TrialResult out;
  out.case_name = name;
  out.state = TrialState::done;
  for (const auto& [condition, scores] : run.scores.conditions) {
    tables::SetResult set{scores_of(scores.model, run.names)};
    for (const auto& [reference, values] : scores.references)
      set.references.emplace_back(reference, scores_of(values, run.names));
    out.sets.emplace_back(condition, std::move(set));
  }
  return out;
}

/// Best, middle and worst held-out sequence, from clouds.
std::vector<Play> played_extremes(const Measured& run, uint64_t seed) {
  const SystemScores* scores = run.scores.find("clouds");
  if (scores == nullptr) return {};
  const auto metric =
      std::find_if(metrics::table().begin(), metrics::table().end(),
                   [](const metrics::Metric& m) { return std::string(m.name) == kRanked; });
  const auto m = static_cast<size_t>(metric - metrics::table().begin());
  std::vector<std::pair<double, size_t>> ranked;
  for (size_t s = 0; s < scores->model.sequences.size(); ++s)
    if (const auto& value = scores->model.sequences[s][m]) ranked.emplace_back(*value, s);
  std::sort(ranked.begin(), ranked.end());
  std::vector<std::pair<const char*, size_t>> chosen;
  if (!ranked.empty()) chosen.emplace_back("best", 0);
  if (ranked.size() > 2) chosen.emplace_back("middle", ranked.size() / 2);
  if (ranked.size() > 1) chosen.emplace_back("worst", ranked.size() - 1);
  std::vector<Play> out;
  for (const auto& [place, rank] : chosen) {
    const auto& [error, s] = ranked[rank];
    const Scratch scratch;
    write_sequence(Performance(run.test, run.how.sequences[s], run.how.scans, seed),
                   {run.test.license, run.test.description}, scratch.folder());
    out.push_back(
        played(run.weights, scratch.folder(),
               format("%s: %s, PA-MPJPE %.0f mm", place, run.names[s].c_str(), 1e3 * error), seed));
  }
  return out;
}

/// One run is held against the configuration that asks for nothing.
Section differences(const std::vector<tables::Compared>& runs) {
  if (runs.size() > 1) return {"What differs", tables::comparison_markdown(runs)};
  const Scratch scratch;
  write_file_atomically(scratch.file("config.yaml"), resolved_yaml(TrainConfig()));
  tables::Compared defaults = tables::read_compared(scratch.folder());
  defaults.name = "default";
  return {"What differs from the defaults", tables::comparison_markdown({runs[0], defaults})};
}

Section results_section(const tables::Results& results) {
  const tables::Table table = tables::make_table(results, {});
  std::string text = tables::to_markdown(table, results);
  for (const auto* notices : {&results.notices, &table.notices})
    for (const std::string& notice : *notices) text += "\n" + notice + "\n";
  return {"Results", text};
}

// ---- sweeps -------------------------------------------------------------------------------------

std::string trials_text(const tables::Results& results) {
  std::vector<std::vector<std::string>> rows{
      {"trial", "case", "seed", "state", "s", "overrides", "host", "command"}};
  for (const tables::TrialResult& trial : results.trials) {
    const std::string overrides = joined(trial.overrides, [](const auto& one) {
      return one.first + "=" + tables::plain_text(one.second);
    });
    std::string state = tables::kTrialStates[static_cast<int>(trial.state)];
    if (!trial.error.empty()) state += ": " + trial.error;
    rows.push_back({trial.id, trial.case_name, std::to_string(trial.seed), state,
                    format("%.0f", trial.seconds), overrides, trial.host, trial.command});
  }
  for (auto& row : rows)
    for (std::string& cell : row) cell = tables::for_markdown(cell);
  return tables::counts_text(results) + "\n\n" + markdown_table(rows);
}

/// The ends of the logs of trials that failed.
void add_failures(const std::string& dir, const tables::Results& results,
                  std::vector<Section>* sections) {
  constexpr int kLines = 12;
  Section out{"Failed trials", "The last lines of their logs.\n"};
  for (const tables::TrialResult& trial : results.trials) {
    if (trial.state != TrialState::failed) continue;
    const std::string log = dir + "/trials/" + trial.id + "/log.txt";
    std::string lines = sweep::last_lines(log, kLines);
    if (lines.empty()) lines = trial.error;
    out.quoted.emplace_back(log, lines);
  }
  if (!out.quoted.empty()) sections->push_back(std::move(out));
}

/// Without a plan that can be read there is no figure that all trials share.
void add_pictures(const std::string& dir, const tables::Results& results, Report* out) {
  std::optional<sweep::SweepDir> sweep;
  try {
    sweep = sweep::read_sweep_dir(dir);
  } catch (const InputError&) {  // read_results() told it
    return;
  }
  for (Section& section : sweep_pictures(*sweep, results))
    out->before.push_back(std::move(section));
  out->unfinished = !sweep::look_at(*sweep, "").over();
}

/// The trial that is asked for, or the one with the least error over all sets.
std::string chosen_trial(const tables::Results& results, const std::string& wanted) {
  std::string best;
  double least = 0;
  for (const tables::TrialResult& trial : results.trials) {
    if (trial.state != TrialState::done) continue;
    double sum = 0;
    int n = 0;
    for (const auto& [set, scores] : trial.sets)
      if (const auto value = scores.mean.find(kRanked); value != scores.mean.end())
        sum += value->second, ++n;
    if (n > 0 && (best.empty() || sum / n < least)) best = trial.id, least = sum / n;
  }
  if (wanted.empty() && best.empty())
    throw InputError("", "no trial of the sweep has an answer to play",
                     "leave --sequence out, or run the sweep");
  return wanted.empty() ? best : wanted;
}

/// The networks of a trial, from the store and from where its configuration takes them.
Bundle weights_of(const std::string& dir, const std::string& id) {
  const sweep::SweepDir sweep = sweep::read_sweep_dir(dir);
  const sweep::TrialEntry& trial = sweep.trial(id);
  const fs::path home = fs::path(dir) / sweep.directory;
  TrainConfig config;
  read_config(of_this_version(load_config_tree(in(sweep.folder(id), "config.yaml"))), config);
  Bundle out;
  for (const std::string& stage : config.stages) {
    const auto made = std::find_if(trial.artifacts.begin(), trial.artifacts.end(),
                                   [&](const auto& a) { return a.first == stage; });
    const fs::path from = made == trial.artifacts.end()
                              ? fs::path(*config.section(stage).from)
                              : fs::path(sweep.store) / (stage + "-" + made->second);
    out.add(load_bundle((home / from).string()).only(stage_type(stage).roles));
  }
  return out;
}

}  // namespace

bool is_sweep(const std::string& folder) {
  std::error_code ignored;
  return fs::is_directory(in(folder, "trials"), ignored);
}

std::vector<std::string> inputs_of(const std::string& folder) {
  std::vector<std::string> out;
  for (const char* name : {"config.yaml", "metrics.jsonl", "provenance.json", "weights.safetensors",
                           "sweep.yaml", "plan.json", "log.txt"})
    out.push_back(in(folder, name));
  return out;
}

Report of_runs(const std::vector<std::string>& folders, const GatherOptions& how) {
  Report out;
  out.title = joined(folders, last_part);
  std::string provenance, unmeasured;
  std::vector<std::optional<Measured>> measured;
  check_sequences(how.sequences);
  for (const std::string& folder : folders) {
    out.runs.push_back(tables::read_compared(folder));
    out.runs.back().name = last_part(folder);
    provenance += folder + "\n\n" + provenance_text(folder) + "\n";
    out.files.emplace_back(in(folder, "config.yaml"), read_file(in(folder, "config.yaml")));
    std::string why;
    measured.push_back(prepared(folder, how.seed, &why));
    if (!measured.back()) unmeasured += folder + " is not measured: " + why + "\n";
  }
  tables::Results results;
  for (size_t r = 0; r < folders.size(); ++r) {
    if (!measured[r]) continue;
    measure(folders[r], &*measured[r]);
    results.trials.push_back(result_of(out.runs[r].name, *measured[r]));
    if (!how.play || !out.plays.empty()) continue;
    out.plays = how.sequences.empty() ? played_extremes(*measured[r], how.seed)
                                      : played_folders(measured[r]->weights, how);
  }
  if (!unmeasured.empty()) {
    log_warning(on_one_line(unmeasured));
    out.before.push_back({"Not measured", unmeasured});
  }
  if (!results.trials.empty()) out.before.push_back(results_section(results));
  out.after = {differences(out.runs), {"Provenance", provenance}};
  return out;
}

Report of_sweep(const std::string& dir, const GatherOptions& how) {
  const tables::Results results = tables::read_results(dir);
  check_sequences(how.sequences);
  Report out;
  out.title = last_part(dir);
  for (const tables::TrialResult& trial : results.trials) {
    const std::string folder = dir + "/trials/" + trial.id;
    std::error_code ignored;
    if (trial.state == TrialState::damaged || !fs::exists(in(folder, "config.yaml"), ignored))
      continue;
    out.runs.push_back(tables::read_compared(folder));
    out.runs.back().name = trial.case_name.empty() ? trial.id : trial.case_name + ", " + trial.id;
    out.files.emplace_back(in(folder, "config.yaml"), read_file(in(folder, "config.yaml")));
  }
  if (how.play && !how.sequences.empty()) {
    const std::string id = chosen_trial(results, how.trial);
    out.plays = played_folders(weights_of(dir, id), how);
  }
  out.before = {{"Trials", trials_text(results)}};
  add_failures(dir, results, &out.before);
  out.before.push_back(results_section(results));
  add_pictures(dir, results, &out);
  if (out.runs.size() > 1) out.after.push_back(differences(out.runs));
  if (std::error_code ignored; fs::exists(in(dir, "sweep.yaml"), ignored))
    out.files.emplace(out.files.begin(), in(dir, "sweep.yaml"), read_file(in(dir, "sweep.yaml")));
  return out;
}

}  // namespace restage::report
