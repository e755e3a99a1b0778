// The keys of training configurations (configs/*.yaml). Every key is listed once, here.
#pragma once

#include <set>
#include <string>

#include "autograd/kernels/matmul_precision.h"
#include "datasets/corpus.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/pairs.h"
#include "datasets/sampling/windows.h"
#include "nn/losses/motion.h"
#include "nn/models/registry.h"
#include "train/config_reader.h"
#include "train/optim/adam.h"
#include "train/schedule.h"
#include "train/trainer.h"

namespace restage {

template <class V>
void visit(V& v, SplitCounts& c) {
  v("train", c.train, "how many to train on", positive());
  v("validation", c.validation, "how many to validate on", positive());
  v("test", c.test, "how many to test on", positive());
}

template <class V>
void visit(V& v, CorpusSource& c) {
  v("source", c.source,
    "builtin, a data set file ('restage data import'), or a benchmark's folder");
  v("seed", c.seed, "of the built-in source");
  v("bodies", c.bodies, "built-in bodies per split");
  v("motions", c.motions, "built-in motions per split");
}

template <class V>
void visit(V& v, ModelSizes& c) {
  v("hidden", c.hidden, "SMRM: size of the hidden states; 0: the paper's", at_least(0));
  v("points", c.points, "extractors: points per cloud; 0: the model's own", at_least(0));
  v("width", c.width, "extractors: channels; 0: the model's own", at_least(0));
  v("layers", c.layers, "extractors: blocks or layers; 0: the model's own", at_least(0));
  v("centres", c.centres, "patch transformer: tokens; 0: the model's own", at_least(0));
  v("neighbours", c.neighbours, "extractors: neighbours of a point; 0: the model's own",
    at_least(0));
  v("standardise", c.standardise, "SMRM: inputs in units of the training set's deviation");
  v("rest_pose_start", c.rest_pose_start, "SMRM: first output near the rest pose");
  v("dropout", c.dropout, "dropout rate; -1: the model's own", below(-1, 1));
}

/// What every stage has.
struct OptimiserConfig {
  int64_t steps = 1000, batch = 16;
  ScheduleConfig schedule;
  AdamConfig adam;
  double clip = 0;
};

template <class V>
void visit(V& v, OptimiserConfig& c) {
  v("steps", c.steps, "optimiser steps", positive());
  v("batch", c.batch, "examples per step", positive());
  v("schedule", c.schedule, "learning rate");
  v("adam", c.adam, "optimiser");
  v("clip", c.clip, "largest global norm of the gradient; 0: no clipping", at_least(0));
}

template <class V>
void visit(V& v, CloudConfig& c) {
  v("noise", c.noise, "Gaussian noise per coordinate, metres", at_least(0));
  v("heading", c.heading, "turn clouds by any angle about y");
  v("mirror", c.mirror, "every second cloud mirrored");
  v("tpose_share", c.tpose_share, "part of the clouds that are rest poses", between(0, 1));
  v("tpose_heading", c.tpose_heading, "rest poses turn by up to this, degrees", between(0, 180));
  v("scale_jitter", c.scale_jitter, "bodies scaled by 1 +- this", below(0, 1));
  v("min_fraction", c.min_fraction, "least part of distinct points", between(0.05, 1));
  v("frame_step", c.frame_step, "only every so many frames of a motion (30: one a second)",
    between(1, 100000));
}

struct SkeletonStageConfig {
  enum class Loss { mse, distance };
  std::string model = "skeleton/point_transformer";
  ModelSizes sizes;
  OptimiserConfig optimiser;
  CloudConfig clouds;
  Loss loss = Loss::mse;
  double vote_weight = 0, segmentation_weight = 0;
  int64_t validation_clouds = 200;
};

inline EnumNames<SkeletonStageConfig::Loss> config_names(SkeletonStageConfig::Loss) {
  return {{"mse", SkeletonStageConfig::Loss::mse},
          {"distance", SkeletonStageConfig::Loss::distance}};
}

template <class V>
void visit(V& v, SkeletonStageConfig& c) {
  v("model", c.model, "one of skeleton/* (restage info)");
  v("sizes", c.sizes, "sizes that differ from the model's own");
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("clouds", c.clouds, "how training clouds are made");
  v("loss", c.loss, "mse (the paper) or mean distance");
  v("vote_weight", c.vote_weight, "voting models: weight of each centre's own votes", at_least(0));
  v("segmentation_weight", c.segmentation_weight,
    "voting models: weight of naming the moving joint", at_least(0));
  v("validation_clouds", c.validation_clouds, "held-out clouds per validation", positive());
}

template <class V>
void visit(V& v, MotionWeights& c) {
  v("cycle", c.cycle, "joints and translation after A -> B -> A", at_least(0));
  v("adversarial", c.adversarial, "the discriminator's judgement of B; 0: no discriminator",
    at_least(0));
  v("rotation", c.rotation, "rotations after A -> B -> A against the data's", at_least(0));
  v("smoothness", c.smoothness, "frame differences after A -> B -> A", at_least(0));
  v("self", c.self, "reconstruction of self samples", at_least(0));
  v("self_rotation", c.self_rotation, "rotations of self samples against the data's", at_least(0));
  v("twist", c.twist, "NKN's twist limit", at_least(0));
}

inline EnumNames<Translation> config_names(Translation) {
  return {{"velocity", Translation::velocity},
          {"relative", Translation::relative},
          {"absolute", Translation::absolute}};
}

template <class V>
void visit(V& v, WindowConfig& c) {
  v("frames", c.frames, "frames per window", at_least(2));
  v("self_share", c.self_share, "part of the samples whose target is A itself", between(0, 1));
  v("noise", c.noise, "Gaussian noise on input joints, metres", at_least(0));
  v("noise_correlation", c.noise_correlation, "of one frame's noise with the next's", below(0, 1));
  v("noisy_translation", c.noisy_translation, "noise of the pelvis also in the translation");
  v("heading", c.heading, "turn windows by any angle about y");
  v("mirror", c.mirror, "every second window mirrored");
  v("per_motion", c.per_motion, "every motion as likely (else every frame)");
  v("translation", c.translation, "velocity, relative or absolute");
  v("remove_heading", c.remove_heading, "turn every frame to face +z before the network");
}

/// The defaults are what trains; configs/paper/as_printed.yaml keeps the paper's letter
/// (docs/method.md).
struct MotionStageConfig {
  std::string model = "smrm/rot6d";
  ModelSizes sizes{.standardise = true, .rest_pose_start = true};
  OptimiserConfig optimiser;
  WindowConfig windows{.self_share = 0.7, .remove_heading = true};
  MotionWeights weights{.adversarial = 0.001, .rotation = 1};
  AdamConfig discriminator_adam;
  double balance_limit = 0.3;
  bool self_first_pass = true;
  int64_t validation_windows = 64, validation_frames = 60;
};

template <class V>
void visit(V& v, MotionStageConfig& c) {
  v("model", c.model, "smrm/rot6d or smrm/quaternion", one_of({"smrm/rot6d", "smrm/quaternion"}));
  v("sizes", c.sizes, "sizes that differ from the model's own");
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("windows", c.windows, "how training windows are made");
  v("weights", c.weights, "of the loss terms");
  v("discriminator_adam", c.discriminator_adam, "the discriminator's optimiser");
  v("balance_limit", c.balance_limit,
    "the discriminator rests while its running score of fakes is below this", between(0, 1));
  v("self_first_pass", c.self_first_pass,
    "self samples do one supervised pass A -> A instead of the cycle");
  v("validation_windows", c.validation_windows, "held-out windows per validation", positive());
  v("validation_frames", c.validation_frames, "frames of each", at_least(3));
}

template <class V>
void visit(V& v, PairConfig& c) {
  v("points", c.points, "points per pair", positive());
  v("heading", c.heading, "turn poses by any angle about y");
  v("mirror", c.mirror, "every second pair mirrored");
  v("frame_step", c.frame_step, "only every so many frames of a motion (30: one a second)",
    between(1, 100000));
}

struct DeformationStageConfig {
  OptimiserConfig optimiser;
  PairConfig pairs;
  int64_t skinning_steps = 0;
  bool offsets = true, root_net = false, keep_root_rotation = true;
  double dropout = -1;
  int64_t validation_pairs = 60;
};

template <class V>
void visit(V& v, DeformationStageConfig& c) {
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("pairs", c.pairs, "how training pairs are made");
  v("skinning_steps", c.skinning_steps, "first steps without offsets (the paper: one epoch)",
    at_least(0));
  v("offsets", c.offsets, "train pose-corrective offsets");
  v("root_net", c.root_net, "also train the third MLP (docs/method.md)");
  v("keep_root_rotation", c.keep_root_rotation, "offsets see the root's rotation (false: zero)");
  v("dropout", c.dropout, "dropout rate; -1: the model's own (0.2)", below(-1, 1));
  v("validation_pairs", c.validation_pairs, "held-out pairs per validation", positive());
}

struct EvaluationConfig {
  int64_t sequences = 12, frames = 90;
};

template <class V>
void visit(V& v, EvaluationConfig& c) {
  v("sequences", c.sequences, "held-out sequences of 'restage eval run=...'", positive());
  v("frames", c.frames, "frames of each", at_least(3));
}

inline EnumNames<MatmulPrecision> config_names(MatmulPrecision) {
  return {{"float32", MatmulPrecision::float32}, {"bfloat16", MatmulPrecision::bfloat16}};
}

/// A whole training.
struct TrainConfig {
  std::string name = "restage";
  std::string run_root = "runs";
  uint64_t seed = 0;
  MatmulPrecision precision = MatmulPrecision::float32;
  std::vector<std::string> stages = {"skeleton", "motion", "deformation"};
  CorpusSource data;
  SkeletonStageConfig skeleton;
  MotionStageConfig motion;
  DeformationStageConfig deformation;
  LoopConfig loop;
  EvaluationConfig evaluation;
};

template <class V>
void visit(V& v, TrainConfig& c) {
  v("name", c.name, "run directories are <run_root>/<name>-<time>-<n>");
  v.check("name", !c.name.empty() && c.name.size() <= 100 && c.name.find('/') == std::string::npos,
          "is not the name of a folder in run_root", "give 1 to 100 characters without '/'");
  v("run_root", c.run_root, "folder of run directories");
  v("seed", c.seed, "of everything random");
  v("precision", c.precision, "of the matrix products of training steps; all else is float32");
  v("stages", c.stages, "which stages, in order", one_of({"skeleton", "motion", "deformation"}));
  v("data", c.data, "bodies and motions");
  v("skeleton", c.skeleton, "the skeleton extractor");
  v("motion", c.motion, "the motion retargeting network");
  v("deformation", c.deformation, "skinning weights and offsets");
  v("loop", c.loop, "logging, validation, checkpoints");
  v("evaluation", c.evaluation, "what 'restage eval run=...' looks at");
  const std::set<std::string> once(c.stages.begin(), c.stages.end());
  v.check("stages", !c.stages.empty() && once.size() == c.stages.size(),
          "must name each stage at most once, and at least one",
          "use skeleton, motion, deformation");
}

}  // namespace restage
