// The root of training configurations (configs/*.yaml): data, loop, and a section for every stage.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "autograd/kernels/matmul_precision.h"
#include "datasets/corpus.h"
#include "datasets/sampling/evaluation.h"
#include "train/stages/registry.h"
#include "train/trainer.h"

namespace restage {

template <class V>
void visit(V& v, SplitCounts& c) {
  v("train", c.train, "how many to train on", between(1, 1e5));
  v("validation", c.validation, "how many to validate on", between(1, 1e5));
  v("test", c.test, "how many to test on", between(1, 1e5));
}

template <class V>
void visit(V& v, CorpusSource& c) {
  v("source", c.source,
    "builtin, a data set file ('restage data import'), or a benchmark's folder");
  v("seed", c.seed, "of the built-in source");
  v("bodies", c.bodies, "built-in bodies per split");
  v("motions", c.motions, "built-in motions per split");
  v("one_mesh", c.one_mesh,
    "built-in bodies have one mesh, for networks that need vertices in correspondence",
    added("false"));
  v("subject", c.subject, "train on motions of this person alone; empty: of all", added("\"\""));
}

struct EvaluationConfig {
  int64_t sequences = 12, frames = 90, every = 1;
  std::string system = "chain";  ///< infer/systems.h
  double anchor = 0.25;          ///< of RetargetOptions
  /// Of RetargetOptions, where true is usual.
  bool steady_bones = false, keep_limbs = false, any_size = false, any_way_up = false;
  ScanConfig scans;
};

template <class V>
void visit(V& v, ScanConfig& c) {
  v("least", c.least, "fewest points of a frame", at_least(64));
  v("most", c.most, "most points of a frame", between(64, 1'000'000));
  v.check("most", c.most >= c.least, "is less than 'least'", "give at least as many");
  v("noise", c.noise, "Gaussian noise per coordinate, metres", at_least(0));
  v("hole", c.hole, "nothing is seen so many metres around one point of the body", between(0, 0.5));
}

template <class V>
void visit(V& v, EvaluationConfig& c) {
  v("sequences", c.sequences, "held-out sequences of 'restage eval run=...'", between(1, 1e5));
  v("frames", c.frames, "frames of each", between(3, 1e6));
  v("system", c.system, "which system a sweep's trial is: 'restage retarget --system'");
  v("anchor", c.anchor, "'restage retarget --anchor', seconds; 0: off", at_least(0));
  v("steady_bones", c.steady_bones,
    "the source's bones are held at their mean length so far, as 'restage retarget' does",
    added("false"));
  v("keep_limbs", c.keep_limbs, "limbs that cross keep their names, as 'restage retarget' does",
    added("false"));
  v("any_size", c.any_size, "people of any size are seen in an adult's, as 'restage retarget' does",
    added("false"));
  v("any_way_up", c.any_way_up,
    "who lies or stands on the hands is shown upright, as 'restage retarget' does", added("false"));
  v("scans", c.scans, "held-out sequences as they are seen");
  v("every", c.every, "a sweep's trial is measured on every so many frames", positive());
}

inline EnumNames<MatmulPrecision> config_names(MatmulPrecision) {
  return {{"float32", MatmulPrecision::float32}, {"tf32", MatmulPrecision::tf32}};
}

/// One stage of a configuration: trained as its own keys say, or taken as it is.
struct StageSection {
  std::optional<std::string> from;  ///< weights file, run or artifact: the stage is not trained
  /// Weights file, run or artifact: the stage is trained on from its weights.
  std::optional<std::string> init;
  std::vector<std::string> init_names = {"*"};
  AnyConfig config;  ///< the keys of the stage itself
};

template <class V>
void visit(V& v, StageSection& c) {
  v("from", c.from, "take the stage's networks from a weights file, run or artifact; no training");
  v("init", c.init, "start from those of a weights file, run or artifact instead of random ones");
  v("init_names", c.init_names, "which tensors init takes; * stands for any text");
  v.check("init", !c.init || !c.from, "makes no sense with 'from', which trains nothing",
          "give one of them");
  visit(v, c.config);
}

/// A whole training.
struct TrainConfig {
  TrainConfig() {
    for (const StageType& type : stage_types()) {
      sections.emplace_back(type.name, StageSection{});
      sections.back().second.config = type.config;
    }
  }
  StageSection& section(const std::string& stage) {
    for (auto& entry : sections)
      if (entry.first == stage) return entry.second;
    throw Error("there is no stage " + stage);
  }
  const StageSection& section(const std::string& stage) const {
    return const_cast<TrainConfig*>(this)->section(stage);
  }

  /// The names in `stages` of those that are trained, not taken as they are.
  std::vector<std::string> trained() const {
    std::vector<std::string> out = stages;
    std::erase_if(out,
                  [this](const std::string& stage) { return section(stage).from.has_value(); });
    return out;
  }

  std::vector<std::string> python;
  std::string name = "restage";
  std::string run_root = "runs";
  uint64_t seed = 0;
  MatmulPrecision precision = MatmulPrecision::float32;
  std::string device = "cpu";
  std::vector<std::string> stages = {"skeleton", "motion", "deformation"};
  CorpusSource data;
  std::vector<std::pair<std::string, StageSection>> sections;  ///< by name, of every stage there is
  LoopConfig loop;
  EvaluationConfig evaluation;
};

/// `left`: a configuration as a run or a trial has left it, perhaps one of an earlier version,
/// which wrote a section for every stage that there was. Returns it without the sections of stages
/// that are no more, unless `stages` names them.
ConfigNode of_this_version(ConfigNode left);

template <class V>
void visit(V& v, TrainConfig& c) {
  // Comes first: the names of its networks are checked below.
  v("python", c.python, "files of Python that define networks, seen from this file's folder");
  v.check("python", c.python.empty() || has_network_importer(),
          "names networks that are written in Python, which this program cannot run",
          "say 'python3 -m restage' in the place of 'restage'");
  import_networks(c.python);
  v("name", c.name, "run directories are <run_root>/<name>-<time>-<n>");
  v.check("name", !c.name.empty() && c.name.size() <= 100 && c.name.find('/') == std::string::npos,
          "is not the name of a folder in run_root", "give 1 to 100 characters without '/'");
  v("run_root", c.run_root, "folder of run directories");
  v("seed", c.seed, "of everything random");
  v("precision", c.precision, "of the matrix products of training steps; all else is float32");
  v("device", c.device, "where networks are trained: cpu, or cuda in a program built for it");
  v.check("precision", c.precision != MatmulPrecision::tf32 || c.device != "cpu",
          "is tf32, which only GPUs have", "give float32, or device: cuda");
  v("stages", c.stages, "which stages, in order", one_of(stage_names()));
  v("data", c.data, "bodies and motions");
  for (auto& [name, section] : c.sections) v(name, section, stage_type(name).help);
  v("loop", c.loop, "logging, validation, checkpoints");
  v("evaluation", c.evaluation, "what 'restage eval run=...' looks at");
  const std::string unknown = unknown_figure(c.loop.selection.monitor);
  v.check("loop", unknown.empty(), "monitors '" + unknown + "', which no stage measures",
          "give STAGE.FIGURE, such as motion.pa_mpjpe");
  const std::set<std::string> once(c.stages.begin(), c.stages.end());
  const bool learned = c.evaluation.system == EvaluationConfig().system;
  v.check("stages", (!learned || !c.stages.empty()) && once.size() == c.stages.size(),
          "must name each stage at most once, and at least one", "name each stage once");
}

}  // namespace restage
