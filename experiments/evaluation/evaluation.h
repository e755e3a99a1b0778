// The whole system on held-out bodies and subjects: what `restage eval run=RUN` prints.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "datasets/sampling/evaluation.h"
#include "experiments/evaluation/predictions.h"
#include "infer/systems.h"
#include "nn/metrics/metrics.h"
#include "train/training/train_config.h"

namespace restage {

/// One way of looking at the same sequences.
struct SystemScores {
  metrics::Evaluation model;
  std::vector<int64_t> frames;
  References references;
  /// Of each sequence the mean error of every joint, every frame aligned with scale, metres.
  std::vector<std::vector<double>> joint_errors;
  /// Of all frames that a system says its confidence of, and their PA-MPJPE in metres.
  std::vector<double> confidence, frame_errors;
};

/// What weights can be judged on, and what they cannot.
struct SystemEvaluation {
  /// By condition, as far as there are models for it:
  ///   "clouds"          clouds in, the target's joints extracted: end to end (skeleton, motion)
  ///   "true_vertices"   in the place of clouds, for a network that needs the source's vertices in
  ///                     the target's order (transfer)
  ///   "true_skeletons"  true joints of source and target: no extractor (motion)
  ///   "source_joints", "rest_joints"  of weights that are an extractor alone: its joints of the
  ///                     source's clouds and of the target's T-pose (skeleton)
  ///   "true_poses"      true joints and rotations of the target: its surface alone (deformation)
  std::vector<std::pair<std::string, SystemScores>> conditions;
  /// Extractor alone, metres; empty without one.
  std::optional<double> joint_error, tpose_joint_error;
  /// "clouds: no model for skeleton"
  std::vector<std::string> missing;

  /// Null if it could not be judged.
  const SystemScores* find(const std::string& condition) const;
};

struct EvaluationOptions {
  uint64_t seed = 0;
  std::string system = "chain";  ///< others are judged from clouds only
  int64_t every = 1;             ///< frame of the sequences
  double anchor = RetargetOptions{}.anchor;
  /// See EvaluationConfig.
  bool steady_bones = false, keep_limbs = false, any_size = false, any_way_up = false;
  std::vector<EvalSequence> sequences;
  ScanConfig scans;
  CloudConfig clouds;  ///< of the extractor's own figures
  std::span<const metrics::Metric> metrics = metrics::table();
};

/// Judges the models of `weights` on the bodies and motions of `corpus`.
SystemEvaluation evaluate_system(const Bundle& weights, const std::string& weights_name,
                                 const Corpus& corpus, const EvaluationOptions& options);

/// Mean error of every joint over the frames, aligned with scale, metres; empty without joints.
std::vector<double> joint_errors(const metrics::Track& pred, const metrics::Track& truth);

/// A name for each sequence: motion, first frame, both bodies.
std::vector<std::string> sequence_names(const std::vector<EvalSequence>& list, const Corpus& test);
/// What `restage eval run=` looks at: the sequences and clouds of a training's configuration.
EvaluationOptions evaluation_options(const TrainConfig& config, const Corpus& test, uint64_t seed);

}  // namespace restage
