// Binary glTF 2.0 (GLB): one file with the target, its skeleton, its skin and an animation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The four joints that move a vertex most, for every vertex: the strongest first, the four weights
/// summing to 1 in float32 (within one or two units in the last place). If fewer than four joints
/// move a vertex, the remaining places hold joint 0 and weight 0.
struct Influences {
  std::vector<std::array<uint8_t, 4>> joints;
  std::vector<std::array<float, 4>> weights;
};
/// Of two joints with the same weight, the one with the lower number comes first. InputError if a
/// row holds a negative number or one that is not finite, or is zero throughout.
Influences strongest_four(const SkinWeights& weights);

/// How exact the file is: distances between vertices skinned with all 22 weights and the same
/// vertices skinned with the four weights that are in the file (linear blend skinning both), over
/// all vertices and all frames written. Metres.
struct InfluenceError {
  double mean = 0, p95 = 0, max = 0;
};

/// Collects poses and writes the file at commit(). The file holds 22 nodes named as in kJointNames,
/// whose translations are the offsets of the rest joints and which have no rest rotation; the
/// inverse bind matrix of joint j is translate(-J_j). Rotations are unit quaternions, with signs
/// that make curves continuous, LINEAR, at `fps`; only the root is translated; y is up, units are
/// metres. A target without faces becomes a POINTS primitive. Programs pose the file by linear
/// blend skinning, so the offsets of the deformation model, which depend on the pose, are not in
/// the file (PLY, OBJ and HDF5 hold the exact surface). Memory: the mesh, and 364 bytes a frame.
/// The file's bytes depend on the input only.
class GlbWriter {
 public:
  /// InputError: see check_mesh(). ShapeError if `weights` has not one row a vertex.
  GlbWriter(std::string path, Mesh mesh, const Joints& rest, const SkinWeights& weights,
            double fps = kFps);
  /// Adds a frame. `confidence` must be given for all frames or for none; the file holds the
  /// numbers in the animation's extras. WorkError if the pose is not finite.
  void push(const Pose& pose, std::optional<double> confidence = std::nullopt);
  /// The numbers of the frames that have no cloud of the source behind them
  /// (RetargetedFrame::filled). The file holds the numbers in the animation's extras.
  void set_filled(std::vector<int64_t> frames) { filled_ = std::move(frames); }
  /// Writes the file. Its `asset.extras` say fps, units and the influence error in millimetres.
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
  SkinWeights lost_;                         ///< the file's weights minus the given ones
  std::vector<std::array<float, 4>> turns_;  ///< 22 quaternions (x, y, z, w) a frame
  std::vector<float> roots_;                 ///< the root's place, 3 numbers a frame
  std::vector<double> confidence_;
  std::vector<int64_t> filled_;
  std::vector<uint64_t> histogram_;  ///< of distances, in bins of kBin metres; for the percentile
  double error_sum_ = 0, error_max_ = 0;
};

}  // namespace restage
