// Samples of H4D: windows of clouds of one body, and what its codes make of them if they are right
// (spec 9.3).
#pragma once

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/surface.h"

namespace restage {

struct CodeWindowConfig {
  int frames = 30;     ///< of a window
  int points = 8192;   ///< of a cloud
  double heading = 0;  ///< windows are turned about y by up to so many degrees to either side
  int frame_step = 1;  ///< frames of the motion from one of a window to the next
};

/// float32, metres. Every cloud is relative to the mean of its points.
struct CodeWindowBatch {
  Tensor clouds;  ///< [N, T, P, 3], for each frame other points, uniform by area
  Tensor rest;    ///< [N, P, 3] the body in T-pose, in the same way
  Tensor truth;   ///< [N, T, V, 3] vertices of the posed body, its pelvis where it rests
  Tensor body;    ///< i32 [N] number of the body in the corpus

  /// named_tensors() and moved() of it.
  template <class F>
  void each(F&& f) {
    f("clouds", clouds);
    f("rest", rest);
    f("truth", truth);
    f("body", body);
  }
};

class CodeWindowSampler {
 public:
  /// Keeps a reference to `corpus`. `vertices`: which of a body's are the truth, the same of every
  /// body. InputError: settings out of range, no motion of that length, a body without surface or
  /// without one of `vertices`.
  CodeWindowSampler(const Corpus& corpus, const CodeWindowConfig& config,
                    std::vector<int32_t> vertices, uint64_t seed);

  /// Samples number first ... first + n - 1. Sample i is a function of (corpus, config, seed, i): a
  /// random body in a random window of all motions.
  CodeWindowBatch batch(int64_t first, int64_t n) const;
  /// Poses of the same samples: rotation vectors of the local rotations, radians, without jumps
  /// within a window [n, T, 66].
  Tensor poses(int64_t first, int64_t n) const;
  const std::vector<int32_t>& vertices() const { return vertices_; }

 private:
  struct Subject {
    size_t body;
    FrameRef at;  ///< the first frame
    double turn;  ///< about y, radians
  };
  Subject subject(int64_t index) const;
  Pose pose(const Subject& subject, int frame) const;
  void fill(CodeWindowBatch& batch, int64_t row, int64_t index) const;

  const Corpus& corpus_;
  CodeWindowConfig config_;
  std::vector<int32_t> vertices_;
  RngKey key_;
  FrameIndex frames_;
  std::vector<SurfaceSampler> surfaces_;
};

}  // namespace restage
