#include "experiments/sweep/trial_work.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/parallel.h"
#include "autograd/kernels/matmul_precision.h"
#include "autograd/tensor/tensor.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/readers/sha256.h"
#include "experiments/evaluation.h"
#include "train/config.h"
#include "train/run_provenance.h"
#include "train/stages/registry.h"

namespace restage::sweep {
namespace {

namespace fs = std::filesystem;
constexpr size_t kIdDigits = 12;

/// Keys in alphabetical order, numbers as numbers: the same for every way to write a value, since
/// the tree comes from a struct that was read.
nlohmann::json canonical(const ConfigNode& node) {
  using Kind = ConfigNode::Kind;
  if (node.kind == Kind::null) return nullptr;
  if (node.kind == Kind::map) {
    nlohmann::json out = nlohmann::json::object();
    for (const ConfigNode& entry : node.children) out[entry.key] = canonical(entry);
    return out;
  }
  if (node.kind == Kind::list) {
    nlohmann::json out = nlohmann::json::array();
    for (const ConfigNode& item : node.children) out.push_back(canonical(item));
    return out;
  }
  return node.text;
}

std::string id_of(const nlohmann::json& what) { return sha256(what.dump()).substr(0, kIdDigits); }

TrainConfig read(const ConfigNode& tree) {
  TrainConfig config;
  read_config(tree, config);
  return config;
}

/// The stages of a system that can be evaluated as a whole.
bool whole(const ModelSet& models) { return models.skeleton && models.smrm && models.weights; }

Json metrics_json(const metrics::Values& values) {
  Json out = Json::object();
  for (size_t m = 0; m < values.size(); ++m)
    out[metrics::table()[m].name] = values[m] ? Json(*values[m]) : Json(nullptr);
  return out;
}

Json scores_json(const SystemScores& scores, const std::vector<std::string>& names) {
  Json sequences = Json::array();
  for (size_t s = 0; s < scores.model.sequences.size(); ++s) {
    Json one = {{"name", names[s]}, {"frames", scores.frames[s]}};
    one.update(metrics_json(scores.model.sequences[s]));
    sequences.push_back(std::move(one));
  }
  return {{"mean", metrics_json(scores.model.mean)}, {"sequences", std::move(sequences)}};
}

std::vector<std::string> names_of(const std::vector<EvalSequence>& list, const Corpus& test) {
  std::vector<std::string> out;
  for (const EvalSequence& s : list)
    out.push_back(test.motions[s.motion].id + "@" + std::to_string(s.first) + ":" +
                  test.bodies[s.body_a].id + ">" + test.bodies[s.body_b].id);
  return out;
}

/// The run's own held-out data.
Json evaluate_held_out(const ModelSet& models, const TrainConfig& config) {
  Json out = Json::object();
  if (!whole(models)) return out;
  const Corpus test = load_corpus(config.data, "test");
  const auto list =
      evaluation_sequences(test, static_cast<size_t>(config.evaluation.sequences),
                           static_cast<size_t>(config.evaluation.frames), config.seed);
  const SystemEvaluation scores =
      evaluate_system(models, test, list, config.seed, RetargetOptions{}.anchor);
  const auto names = names_of(list, test);
  out["held_out"] = scores_json(scores.extracted, names);
  out["held_out_true_skeletons"] = scores_json(scores.truth, names);
  return out;
}

/// The run in the trial's folder, taken up where it was.
RunDir open_run(const std::string& folder, const TrainConfig& config, const Corpus& data) {
  for (const auto& entry : fs::directory_iterator(folder))  // what a killed process left
    if (entry.path().filename().string().starts_with(".run.draft")) fs::remove_all(entry.path());
  const std::string run = folder + "/run";
  if (fs::exists(run)) return RunDir::resume(run, config.stages);
  RunInput input{config.seed, threads(), {"restage", "trial"}, {}};
  if (config.data.source != "builtin")
    input.data.push_back({config.data.source, checksum(data)});
  return RunDir::create_at(run, resolved_yaml(config), provenance_json(input), config.stages);
}

}  // namespace

/// Checksums of data by the section that names them, and stages that were found to be good.
struct TrialPlanner::Memory {
  Evaluate evaluate;
  std::string store, benchmark;  // its manifest's SHA-256
  std::map<std::string, std::string> training, test;
  std::set<std::string> good;
  std::string loaded;  // of these:
  Corpus train, validation;

  void load(const TrainConfig& config, const std::string& key) {
    if (loaded == key) return;
    train = load_corpus(config.data, "train");
    validation = load_corpus(config.data, "validation");
    loaded = key;
  }
  void look(const TrainConfig& config, const std::string& key) {
    if (training.contains(key)) return;
    load(config, key);
    training[key] = checksum(train) + checksum(validation);
    if (evaluate.benchmark.empty()) test[key] = checksum(load_corpus(config.data, "test"));
  }
  /// Models of unknown names, sizes that do not fit together, windows longer than every motion.
  void check(const TrainConfig& config, const std::string& key, const std::string& stage,
             const std::string& id) {
    if (!good.insert(id).second) return;
    load(config, key);
    make_stage(stage, config, train, validation);
  }
};

TrialPlanner::TrialPlanner(Evaluate evaluate, std::string store)
    : memory_(std::make_unique<Memory>()) {
  memory_->evaluate = std::move(evaluate);
  memory_->store = std::move(store);
  const std::string& folder = memory_->evaluate.benchmark;
  if (folder.empty()) return;
  if (!fs::is_regular_file(folder + "/" + kManifestName))
    throw InputError(memory_->evaluate.place.text(),
                     in_quotes(folder) + " is no benchmark (no manifest.json in it)",
                     "build it with 'restage data build --benchmark'");
  memory_->benchmark = sha256_of_file(folder + "/" + kManifestName);
}

TrialPlanner::~TrialPlanner() = default;

PlannedTrial TrialPlanner::plan(const ConfigNode& tree) {
  const TrainConfig config = read(tree);
  ConfigNode resolved = write_config(config);
  const nlohmann::json all = canonical(resolved);
  const std::string data_key = all["data"].dump();
  memory_->look(config, data_key);

  PlannedTrial out;
  out.seed = config.seed;
  out.config_yaml = config_to_yaml(resolved);
  nlohmann::json trial = {{"behaviour", kBehaviour},
                          {"stages", nlohmann::json::array()},
                          {"test", memory_->test[data_key]},
                          {"benchmark", memory_->benchmark},
                          {"sets", memory_->evaluate.sets}};
  if (memory_->evaluate.benchmark.empty()) trial["evaluation"] = all["evaluation"];
  for (const std::string& stage : config.stages) {
    const std::string id = id_of({{"behaviour", kBehaviour},
                                  {"stage", stage},
                                  {"config", all[stage]},
                                  {"precision", all["precision"]},
                                  {"seed", config.seed},
                                  {"data", memory_->training[data_key]}});
    memory_->check(config, data_key, stage, id);
    trial["stages"].push_back({stage, id});
    out.artifacts.push_back({stage, id, artifact_there(memory_->store, stage, id)});
  }
  out.id = id_of(trial);
  return out;
}

std::vector<std::string> TrialPlanner::unread(const ConfigNode& tree,
                                              const std::vector<std::string>& keys) {
  const TrainConfig config = read(tree);
  std::vector<std::string> out;
  for (const std::string& key : keys) {
    const std::string section = key.substr(0, key.find('.'));
    const bool stage = section == "skeleton" || section == "motion" || section == "deformation";
    if (stage &&
        std::find(config.stages.begin(), config.stages.end(), section) == config.stages.end())
      out.push_back(key);
  }
  return out;
}

bool artifact_there(const std::string& store, const std::string& stage, const std::string& id) {
  std::error_code ignored;
  return fs::exists(fs::path(store) / (stage + "-" + id), ignored);
}

TrialOutcome run_trial(const std::string& config_yaml_path, const std::string& id,
                       const Evaluate& evaluate, const std::string& store,
                       const std::string& folder, bool quiet) {
  const ConfigNode tree = load_config_tree(config_yaml_path);
  const TrainConfig config = read(tree);
  if (!evaluate.benchmark.empty())
    throw WorkError("trials cannot be measured on a benchmark yet");
  TrialOutcome out;
  const PlannedTrial planned = TrialPlanner(evaluate, store).plan(tree);
  if (planned.id != id)
    throw InputError(config_yaml_path,
                     "asks another question (" + planned.id + ") than it was planned for",
                     "its data or the program changed: plan the sweep again");
  for (const StageArtifact& artifact : planned.artifacts)
    out.artifacts[artifact.stage] = artifact.id;

  const std::string weights = folder + "/run/weights.safetensors";
  if (!fs::exists(weights)) {
    const Corpus data = load_corpus(config.data, "train");
    const Corpus validation = load_corpus(config.data, "validation");
    RunDir run = open_run(folder, config, data);
    save_models(weights,
                train(
                    run, config.stages, config.loop,
                    [&](const std::string& stage) { return make_stage(stage, config, data, validation); },
                    quiet, config.precision));
  }
  throw_if_stopped();
  out.metrics = evaluate_held_out(load_models(weights, {}), config);
  throw_if_stopped();
  return out;
}

Measured measure_stage(const ConfigNode& tree, const std::string& stage) {
  constexpr int64_t kWarm = 1, kSteps = 3;
  const TrainConfig config = read(tree);
  const Corpus train = load_corpus(config.data, "train");
  const Corpus validation = load_corpus(config.data, "validation");
  const auto made = make_stage(stage, config, train, validation);
  reset_peak_memory();
  auto start = std::chrono::steady_clock::now();
  for (int64_t i = 0; i < kWarm + kSteps; ++i) {
    if (i == kWarm) start = std::chrono::steady_clock::now();
    const MatmulPrecisionScope scope(config.precision);
    made->step(i);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  return {took.count() / kSteps, made->steps(), memory_stats().peak};
}

}  // namespace restage::sweep
