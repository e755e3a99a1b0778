#include "experiments/sweep/trial_work.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/kernels/matmul_precision.h"
#include "datasets/benchmark/manifest.h"
#include "experiments/evaluation/benchmark_sets.h"
#include "experiments/evaluation/evaluation.h"
#include "experiments/slow_work.h"
#include "experiments/sweep/early_stop.h"
#include "nn/config/config.h"
#include "train/training/training.h"

namespace restage::sweep {
namespace {

namespace fs = std::filesystem;

TrainConfig read(const ConfigNode& tree) {
  TrainConfig config;
  read_config(tree, config);
  return config;
}

Json metrics_json(const metrics::Values& values) {
  Json out = Json::object();
  for (size_t m = 0; m < values.size(); ++m)
    out[metrics::recorded()[m].name] = values[m] ? Json(*values[m]) : Json(nullptr);
  return out;
}

Json evaluation_json(const metrics::Evaluation& scores, const std::vector<std::string>& names,
                     const std::vector<int64_t>& frames) {
  Json sequences = Json::array();
  for (size_t s = 0; s < scores.sequences.size(); ++s) {
    Json one = {{"name", names[s]}, {"frames", frames[s]}};
    one.update(metrics_json(scores.sequences[s]));
    sequences.push_back(std::move(one));
  }
  return {{"mean", metrics_json(scores.mean)}, {"sequences", std::move(sequences)}};
}

/// PA-MPJPE by joint, over the sequences that have values.
Json joints_json(const std::vector<std::vector<double>>& errors) {
  Json out = Json::object();
  for (size_t j = 0; j < static_cast<size_t>(kJoints); ++j) {
    double sum = 0;
    int count = 0;
    for (const std::vector<double>& sequence : errors)
      if (j < sequence.size() && std::isfinite(sequence[j])) sum += sequence[j], ++count;
    if (count > 0) out[std::string(kJointNames[j])] = sum / count;
  }
  return out;
}

}  // namespace

Json set_json(const SystemScores& scores, const std::vector<std::string>& names) {
  Json out = evaluation_json(scores.model, names, scores.frames);
  for (const auto& [coverage, risk] :
       metrics::risk_coverage(scores.confidence, scores.frame_errors))
    out["risk_coverage"].push_back({{"coverage", coverage}, {"pa_mpjpe", risk}});
  if (Json joints = joints_json(scores.joint_errors); !joints.empty()) out["joints"] = joints;
  for (const auto& [name, reference] : scores.references)
    out["references"][name] = evaluation_json(reference, names, scores.frames);
  return out;
}

namespace {

/// The run's own held-out data: a set for every condition that its stages can be judged on. The
/// same sequences for every seed, so that trials can be compared sequence by sequence.
Json evaluate_held_out(const Bundle& models, const TrainConfig& config) {
  const Corpus test = load_corpus(config.data, "test");
  EvaluationOptions how = evaluation_options(config, test, 0);
  how.every = config.evaluation.every;
  how.metrics = metrics::recorded();
  const auto names = sequence_names(how.sequences, test);
  Json out = Json::object();
  for (const auto& [name, scores] : evaluate_system(models, "the trial", test, how).conditions)
    out[name] = set_json(scores, names);
  return out;
}

BenchmarkOptions benchmark_options(const TrainConfig& config) {
  BenchmarkOptions how{config.evaluation.system, config.evaluation.every, config.seed};
  how.metrics = metrics::recorded();
  how.anchor = config.evaluation.anchor;
  how.steady_bones = config.evaluation.steady_bones;
  how.keep_limbs = config.evaluation.keep_limbs;
  how.any_size = config.evaluation.any_size;
  how.any_way_up = config.evaluation.any_way_up;
  return how;
}

Json evaluate_benchmark(const Bundle& models, const Evaluate& evaluate, const TrainConfig& config) {
  const BenchmarkOptions how = benchmark_options(config);
  Json out = Json::object();
  SlowWork slow;
  for (const std::string& set : evaluate.sets) {
    slow.on("measuring on the set '" + set + "'");
    std::vector<std::string> names;
    const SystemScores scores =
        evaluate_benchmark_set(models, evaluate.benchmark, set, how, &names);
    out[set] = set_json(scores, names);
  }
  return out;
}

/// The lines of a metrics.jsonl that are validations: those with the first of a stage's figures
/// that there is. Losses of other lines may have names of figures.
std::string validations_of(const std::string& metrics_jsonl, const StageType& stage) {
  for (const std::string& figure : stage.figures) {
    std::string out;
    std::istringstream lines(metrics_jsonl);
    for (std::string line; std::getline(lines, line);)
      if (line.find("\"" + figure + "\"") != std::string::npos) out += line + "\n";
    if (!out.empty()) return out;
  }
  return "";
}

/// How long a stage was trained, and what its validations said.
Json training_json(const Store& store, const StageId& stage, const StageSection& section) {
  const ConfigNode tree = parse_yaml(resolved_yaml(section.config), stage.stage);
  Json out = Json::object();
  if (const ConfigNode* optimiser = tree.find("optimiser"))
    for (const char* key : {"steps", "batch"})
      if (const ConfigNode* value = optimiser->find(key)) out[key] = std::stoll(value->text);
  out["curves"] = Json::array();
  const StageType& type = stage_type(stage.stage);
  const std::string log = validations_of(store.metrics(stage), type);
  for (const std::string& figure : type.figures) {
    Json points = Json::array();
    for (const CurvePoint& point : read_curve(log, figure))
      if (std::isfinite(point.value)) {
        // Some stages log a figure of training under the name of the validation's, before it.
        if (!points.empty() && points.back()[0] == point.done) points.erase(points.size() - 1);
        points.push_back({point.done, point.value});
      }
    if (!points.empty()) out["curves"].push_back({{"figure", figure}, {"points", points}});
  }
  return out;
}

/// Configurations cannot know which systems there are, nor that the benchmark's scans are files.
void check_evaluation(const ConfigNode& tree, const TrainConfig& config, const Evaluate& evaluate) {
  const ConfigNode* evaluation = tree.find("evaluation");
  const auto place = [&](const char* key) {
    const ConfigNode* node = evaluation == nullptr ? nullptr : evaluation->find(key);
    return node == nullptr ? std::string() : node->key_place.text();
  };
  system_type(config.evaluation.system, place("system"));
  if (!evaluate.benchmark.empty() && config.evaluation.scans != ScanConfig{})
    throw InputError(place("scans"), "the benchmark's scans are as they are",
                     "leave out evaluation.scans, or evaluate on the run's own held-out data");
}

}  // namespace

struct TrialPlanner::Memory {
  Evaluate evaluate;
  Store store{""};
  Identities identities;
  std::map<std::string, std::string> more;  // what else determines a trial
  std::set<std::string> good;               // stages, at seed 0, that were found to be so
  std::string loaded;                       // identity of `data`
  std::unique_ptr<TrainingData> data;
  SlowWork waiting;

  /// Models of unknown names, sizes that do not fit together, windows longer than every motion, and
  /// too little held out to measure anything on. None of it depends on the seed, so trials that
  /// differ in nothing else are checked once.
  void check(TrainConfig config, const std::vector<StageId>& stages, const std::string& name) {
    const std::string wanted = identities.data(config.data);
    if (evaluate.benchmark.empty() && good.insert("held out of " + wanted).second) {
      waiting.on("reading the held-out data of " + config.data.source);
      evaluation_options(config, load_corpus(config.data, "test"), 0);
    }
    config.seed = 0;
    const std::vector<StageId> seedless = identities.stages(config);
    bool known = true;
    for (size_t s = 0; s < stages.size(); ++s)
      known = known && (good.contains(seedless[s].id) || store.has(stages[s]));
    if (known) return;
    if (loaded != wanted) {
      waiting.on("reading the training data of " + config.data.source);
      data = std::make_unique<TrainingData>(config.data);
    }
    loaded = wanted;
    waiting.on("setting up the stages of " + name + ", to find mistakes before any work");
    check_stages(config, *data);
    for (const StageId& s : seedless) good.insert(s.id);
  }
};

TrialPlanner::TrialPlanner(Evaluate evaluate, std::string store)
    : memory_(std::make_unique<Memory>()) {
  memory_->evaluate = std::move(evaluate);
  memory_->store = Store(std::move(store));
  const std::string& folder = memory_->evaluate.benchmark;
  if (folder.empty()) return;
  if (!fs::is_regular_file(folder + "/" + kManifestName))
    throw InputError(memory_->evaluate.place.text(),
                     in_quotes(folder) + " is no benchmark (no manifest.json in it)",
                     "build it with 'restage data build configs/data/open_benchmark.yaml'");
  for (const std::string& set : memory_->evaluate.sets) check_benchmark_set(set);
  memory_->more["benchmark"] = content_of(read_manifest(folder));
  for (const std::string& set : memory_->evaluate.sets) memory_->more["sets"] += set + " ";
}

TrialPlanner::~TrialPlanner() = default;

PlannedTrial TrialPlanner::plan(const ConfigNode& tree, const std::string& name) {
  const TrainConfig config = read(tree);
  check_evaluation(tree, config, memory_->evaluate);
  memory_->waiting.on("summing up the bytes of data and weights of " + name + ", its identity");
  const std::vector<StageId> stages = memory_->identities.stages(config);
  memory_->check(config, stages, name);
  PlannedTrial out;
  out.id = memory_->identities.trial(config, memory_->more);
  out.seed = config.seed;
  out.config_yaml = resolved_yaml(config);
  for (const StageId& s : stages) out.artifacts.push_back({s.stage, s.id, memory_->store.has(s)});
  memory_->waiting.on("");
  return out;
}

std::vector<std::string> TrialPlanner::unread(const ConfigNode& tree,
                                              const std::vector<std::string>& keys) {
  const TrainConfig config = read(tree);
  const std::vector<std::string> all = stage_names();
  const auto has = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  std::vector<std::string> out;
  for (const std::string& key : keys) {
    const std::string section = key.substr(0, key.find('.'));
    if (!has(all, section)) continue;
    // A stage that is not trained reads nothing else; 'init', which 'from' excludes, may be none.
    const bool taken = has(config.stages, section) && config.section(section).from &&
                       key != section + ".from" && key != section + ".init";
    if (!has(config.stages, section) || taken) out.push_back(key);
  }
  return out;
}

bool artifact_there(const std::string& store, const std::string& stage, const std::string& id) {
  return Store(store).has({stage, id, ""});
}

TrialOutcome run_trial(const std::string& config_yaml_path, const std::string& id,
                       const Evaluate& evaluate, const std::string& store,
                       const TrainOptions& options, const std::string& last_stage) {
  const ConfigNode tree = of_this_version(load_config_tree(config_yaml_path));
  const TrainConfig config = read(tree);
  const PlannedTrial planned = TrialPlanner(evaluate, store).plan(tree);
  if (planned.id != id)
    throw InputError(config_yaml_path,
                     "asks another question (" + planned.id + ") than it was planned for",
                     "its data or the program changed: plan the sweep again");
  log_info("trial " + id + ", seed " + std::to_string(config.seed));
  TrialOutcome out;
  Identities identities;
  const StoreTraining trained =
      train_in_store(Store(store), config, &identities, options, last_stage);
  for (const StageId& s : trained.artifacts) {
    out.artifacts[s.stage] = s.id;
    out.training[s.stage] = training_json(Store(store), s, config.section(s.stage));
  }
  if (!last_stage.empty()) return out;
  throw_if_stopped();
  out.metrics = evaluate.benchmark.empty() ? evaluate_held_out(trained.bundle, config)
                                           : evaluate_benchmark(trained.bundle, evaluate, config);
  throw_if_stopped();
  return out;
}

std::optional<Prediction> perform(const std::string& config_yaml_path, const std::string& store,
                                  const std::string& sequence_folder) {
  const TrainConfig config = read(of_this_version(load_config_tree(config_yaml_path)));
  Identities identities;
  for (const StageId& stage : identities.stages(config))
    if (!Store(store).has(stage)) return std::nullopt;
  const StoreTraining trained = train_in_store(Store(store), config, &identities, {});
  return retarget_sequence(trained.bundle, sequence_folder, benchmark_options(config));
}

std::vector<StageForecast> measure(const ConfigNode& tree) {
  const TrainConfig config = read(tree);
  return forecast(config, TrainingData(config.data));
}

}  // namespace restage::sweep
