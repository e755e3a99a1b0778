// Binary glTF 2.0 (GLB): the target with skeleton, skin and animation in one file.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The four strongest joints of each vertex, weights falling, summing to 1 in float32 (within an
/// ulp or two). Unused places hold joint 0 and weight 0.
struct Influences {
  std::vector<std::array<uint8_t, 4>> joints;
  std::vector<std::array<float, 4>> weights;
};
/// InputError if a row is negative, not finite or all zero. Ties go to the lower joint.
Influences strongest_four(const SkinWeights& weights);

/// What the file loses: distance, over all vertices and frames written, between linear blend
/// skinning with all 22 weights and with the four that are in the file. Metres.
struct InfluenceError {
  double mean = 0, p95 = 0, max = 0;
};

/// Collects poses and writes the file at commit(). 22 nodes named as kJointNames with the rest
/// offsets as translations and no rest rotation; inverse bind matrix j = translate(-J_j); rotations
/// as unit quaternions, hemisphere-continuous, LINEAR, at `fps`; translation of the root only; y
/// up, metres. A target without faces becomes a POINTS primitive. The file poses by linear blend
/// skinning: the pose-dependent offsets of the deformation model are not in it (PLY, OBJ and HDF5
/// hold the exact surface). Memory: the mesh, and 364 bytes a frame. The bytes depend on the input
/// only.
class GlbWriter {
 public:
  /// InputError for an unusable mesh, ShapeError if the rows of `weights` are not the vertices.
  GlbWriter(std::string path, Mesh mesh, const Joints& rest, const SkinWeights& weights,
            double fps = kFps);
  /// WorkError if the pose is not finite. `confidence` for all frames or for none: it goes into the
  /// animation's extras.
  void push(const Pose& pose, std::optional<double> confidence = std::nullopt);
  /// Frames that have no cloud of the source behind them (RetargetedFrame::filled): they go into the
  /// animation's extras.
  void set_filled(std::vector<int64_t> frames) { filled_ = std::move(frames); }
  /// Writes the file; also in its `asset.extras`: fps, units and the influence error in mm.
  InfluenceError commit();
  InfluenceError influence_error() const;
  size_t frames() const { return roots_.size() / 3; }

 private:
  void measure_cut(const Pose& pose);
  std::string bytes() const;

  std::string path_;
  Mesh mesh_;
  Joints rest_;
  double fps_;
  Influences influences_;
  SkinWeights lost_;                         ///< weights in the file minus all weights
  std::vector<std::array<float, 4>> turns_;  ///< frame-major, 22 per frame, (x, y, z, w)
  std::vector<float> roots_;                 ///< 3 per frame
  std::vector<double> confidence_;
  std::vector<int64_t> filled_;
  std::vector<uint64_t> histogram_;  ///< of errors, kBin metres each, for the percentile
  double error_sum_ = 0, error_max_ = 0;
};

}  // namespace restage
