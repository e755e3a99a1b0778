// Samples of the motion retargeting network: windows of A's motion, B's skeleton, and real windows
// of B for the discriminator (spec 3.3, 4.2: Q1 to Q4 and Q9, 6.1).
//
// A is a random body performing a random clip. B is another random body of the same corpus, or A
// itself with probability `self_share` (self-reconstruction). Bodies and clips are independent
// here, so "the same subject as B" (Q3) means: B's body performing any clip.
#pragma once

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/sampling/augment.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/tracks.h"

namespace restage {

/// How a path r_1 ... r_T of the pelvis is given to the network (spec 3.3).
enum class Translation {
  velocity,  ///< 30 (r_i - r_{i-1}) m/s, the first as the second
  relative,  ///< r_i - r_1
  absolute,  ///< r_i, floor at y = 0
};

struct WindowConfig {
  int frames = 30;
  double self_share = 0.2;
  double noise = 0;              ///< on A's input joints, standard deviation per coordinate, metres
  double noise_correlation = 0;  ///< of one frame's noise with the next's, 0 to below 1
  bool noisy_translation = false;  ///< the pelvis' noise also goes into A's input translation
  bool heading = true;             ///< turn every window by any angle about y
  bool mirror = true;              ///< every second sample is a mirror image, bodies and all
  bool per_motion = true;          ///< every motion is as likely (spec 6.1); else every frame
  Translation translation = Translation::velocity;
  bool remove_heading = false;  ///< every frame is turned to face +z: by A's heading as seen in its
                                ///< input joints (real_b: by its own)
  bool steady_heading = false;  ///< that heading is averaged over the last frames (Heading)
  bool truth = false;           ///< also make the last group of WindowBatch
};

/// float32, metres. Joints are relative to their pelvis, in the world's directions. Velocities as
/// `Translation` says. All of a sample is turned or mirrored together, so kinematics hold.
struct WindowBatch {
  Tensor joints_a;       ///< [N, T, 22, 3] true joints of A
  Tensor input_a;        ///< [N, T, 22, 3] the same as an extractor may see them: with noise
  Tensor trans_a;        ///< [N, T, 3]
  Tensor input_trans_a;  ///< [N, T, 3] trans_a unless `noisy_translation`
  Tensor turns;          ///< [N, T, 22, 3, 3] and
  Tensor uncertainty;    ///< [N, T, 22] of MotionInput, as tracks know them; undefined without
  Tensor reframed;       ///< [N, T, 3, 3] of MotionInput; undefined unless `remove_heading`
  Tensor rest_a;         ///< [N, 22, 3] rest joints
  Tensor rest_b;         ///< [N, 22, 3] equal to rest_a for self samples
  Tensor sixd_a;         ///< [N, T, 132] A's local rotations: per joint columns 0 and 1
  Tensor standing;       ///< [N, T, 2] 1 where A's left, right foot stands, and B's with it
  Tensor self_mask;      ///< [N] 1 for self samples, else 0
  Tensor real_b;         ///< [N, T, 22, 3] B's body performing some clip (discriminator)
  Tensor real_trans_b;   ///< [N, T, 3]

  // What B performing A's clip would be, for validation and for training on pairs
  // (motion.paired_share). Undefined unless `truth`.
  Tensor truth_b;        ///< [N, T, 22, 3]
  Tensor truth_trans_b;  ///< [N, T, 3]
  Tensor truth_sixd_b;   ///< [N, T, 132]
  Tensor root_a;         ///< [N, T, 3] pelvis of A in the world
  Tensor truth_root_b;   ///< [N, T, 3] pelvis of B in the world

  /// named_tensors() and moved() of it.
  template <class F>
  void each(F&& f) {
    f("joints_a", joints_a);
    f("input_a", input_a);
    f("trans_a", trans_a);
    f("input_trans_a", input_trans_a);
    f("turns", turns);
    f("uncertainty", uncertainty);
    f("reframed", reframed);
    f("rest_a", rest_a);
    f("rest_b", rest_b);
    f("sixd_a", sixd_a);
    f("standing", standing);
    f("self_mask", self_mask);
    f("real_b", real_b);
    f("real_trans_b", real_trans_b);
    f("truth_b", truth_b);
    f("truth_trans_b", truth_trans_b);
    f("truth_sixd_b", truth_sixd_b);
    f("root_a", root_a);
    f("truth_root_b", truth_root_b);
  }
};

/// Which bodies and clips a sample uses (indices into the corpus).
struct WindowSubject {
  size_t body_a = 0, body_b = 0;
  bool self = false;
  FrameRef clip, real;                ///< first frames of A's window and of B's own
  const JointTrack* track = nullptr;  ///< of A, if it was seen
  Augmentation augmentation, real_augmentation;
};

class WindowSampler {
 public:
  /// Keeps a reference to `corpus`. InputError: settings out of range, no motion of that length.
  /// With `tracks` (kept by reference), A performs parts of them and is seen as they say, every
  /// track as likely. InputError also if one is shorter than a window.
  WindowSampler(const Corpus& corpus, const WindowConfig& config, uint64_t seed,
                const std::vector<JointTrack>* tracks = nullptr);

  /// Samples number first ... first + n - 1. Sample i is a function of (corpus, config, seed, i).
  WindowBatch batch(int64_t first, int64_t n) const;
  WindowSubject subject(int64_t index) const;
  /// Motions that are long enough: samples per epoch in the paper's count.
  int64_t motions() const { return static_cast<int64_t>(frames_.motions()); }

 private:
  FrameRef place(Rng& rng) const;
  void fill(WindowBatch& batch, int64_t row, int64_t index) const;

  const Corpus& corpus_;
  WindowConfig config_;
  RngKey key_;
  FrameIndex frames_;
  OwnBodies own_;
  const std::vector<JointTrack>* tracks_;
  bool know_turns_, know_uncertainty_;
};

}  // namespace restage
