// Samples of the deformation networks: the same points of a body at rest and posed (spec 5.3, 6.1).
#pragma once

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/sampling/augment.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/surface.h"

namespace restage {

struct PairConfig {
  int points = 1024;
  bool heading = true;        ///< turn the pose by any angle about y
  bool mirror = false;        ///< every second sample is a mirror image
  int frame_step = 1;         ///< only every so many frames of a motion; 30: one per second
  double joint_noise = 0;     ///< of PairBatch::seen_joints, standard deviation per coordinate, m
  double dressed = 0;         ///< part of the pairs that PairBatch::seen_points shows in clothes
  bool skin_weights = false;  ///< also fill PairBatch::weights
};

/// float32, metres.
struct PairBatch {
  Tensor rest_points;   ///< [N, V, 3] relative to the rest pelvis
  Tensor posed_points;  ///< [N, V, 3] the same points, relative to the posed pelvis
  Tensor rest_joints;   ///< [N, 22, 3] relative to the rest pelvis
  Tensor local;         ///< [N, 22, 3, 3] local rotations, root = global orientation
  Tensor axis_angle;    ///< [N, 66] the same as axis x angle, angle in [0, pi]
  Tensor seen_points;   ///< [N, V, 3] rest_points as a target shows them, in clothes perhaps
  Tensor seen_joints;   ///< [N, 22, 3] rest_joints as an extractor sees them, with noise
  Tensor weights;       ///< [N, V, 22] the data's; only with PairConfig::skin_weights

  /// named_tensors() and moved() of it.
  template <class F>
  void each(F&& f) {
    f("rest_points", rest_points);
    f("posed_points", posed_points);
    f("rest_joints", rest_joints);
    f("local", local);
    f("axis_angle", axis_angle);
    f("seen_points", seen_points);
    f("seen_joints", seen_joints);
    f("weights", weights);
  }
};

class PairSampler {
 public:
  /// Keeps a reference to `corpus`. InputError for settings out of range or bodies without surface.
  PairSampler(const Corpus& corpus, const PairConfig& config, uint64_t seed);

  /// Samples number first ... first + n - 1: a random body in a random frame of all motions. Sample
  /// i is a function of (corpus, config, seed, i).
  PairBatch batch(int64_t first, int64_t n) const;
  /// Points number `index` of body `body` in a pose of choice, as a batch of one.
  PairBatch pair(int64_t index, size_t body, const Pose& pose) const;

 private:
  PairBatch make(int64_t n) const;
  void fill(PairBatch& batch, int64_t row, const RngKey& key, size_t body, const Pose& pose,
            const Augmentation& augmentation) const;
  void show(PairBatch& batch, int64_t row, const RngKey& key, size_t body,
            const SurfaceSamples& samples, const Augmentation& augmentation) const;

  const Corpus& corpus_;
  PairConfig config_;
  RngKey key_;
  FrameIndex frames_;
  std::vector<SurfaceSampler> surfaces_;
};

}  // namespace restage
