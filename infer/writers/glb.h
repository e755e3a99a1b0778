// Binary glTF 2.0 (GLB): one file with the target, its skeleton, its skin and an animation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "infer/writers/distances.h"
#include "infer/writers/tracks.h"
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
using InfluenceError = DistanceSummary;

struct GlbOptions {
  double fps = kFps;
  std::string clip = "motion";       ///< the animation's name
  std::string skeleton = "restage";  ///< one of rig_conventions()
  /// Weights of the skin and turns of bones as whole numbers of 16 bits, normals of 8 (which needs
  /// KHR_mesh_quantization), indices of 16 where those do.
  bool small = false;
};

/// What moves the surface besides its skin: morph targets, and their weights in every frame.
struct GlbMorphs {
  /// Of each target three numbers a vertex, from -127 to 127: metres times 127 for a weight of 1.
  std::vector<std::vector<int8_t>> deltas;
  std::vector<float> weights;  ///< of all targets in the first frame, then in the second, ...
  DistanceSummary error;       ///< of the surface that they give, metres
  /// Of each frame the median distance of its cloud's points from the surface, metres; less than 0:
  /// it has no cloud.
  std::vector<double> distance;
};

/// Collects poses and writes the file at commit(). The file holds 22 nodes or more, named and
/// turned as GlbOptions::skeleton says (rig_convention.h), whose translations are the offsets of
/// the rest joints. Rotations are unit quaternions, with signs
/// that make curves continuous, LINEAR, at GlbOptions::fps; only the root is translated; y is up,
/// units are metres. A target without faces becomes a POINTS primitive. Programs pose the file by
/// linear blend skinning, so the offsets of the deformation model, which depend on the pose, are
/// not in the file (PLY, OBJ and HDF5 hold the exact surface); how far that is from the exact
/// surface is measured and written. Memory: the mesh, and 364 bytes a frame. The file's bytes
/// depend on the input only.
class GlbWriter {
 public:
  /// InputError: see check_mesh(). ShapeError if `weights` has not one row a vertex.
  GlbWriter(std::string path, Mesh mesh, const Joints& rest, const SkinWeights& weights,
            GlbOptions options = {});
  /// Adds a frame. `confidence` must be given for all frames or for none; the file holds the
  /// numbers in the animation's extras. `surface`: the exact surface of this frame, null: not
  /// known. WorkError if the pose is not finite.
  void push(const Pose& pose, std::optional<double> confidence = std::nullopt,
            const Points* surface = nullptr);
  /// The numbers of the frames that have no cloud of the source behind them
  /// (RetargetedFrame::filled). The file holds the numbers in the animation's extras.
  void set_filled(std::vector<int64_t> frames) { filled_ = std::move(frames); }
  /// For all frames, after the last push(). Targets are bytes (KHR_mesh_quantization), and the
  /// weights an animation's channel. ShapeError if vertices or frames are others.
  void set_morphs(GlbMorphs morphs);
  /// The file. Its `asset.extras` say fps, units and the influence error in millimetres.
  std::string bytes() const;
  /// Writes it.
  InfluenceError commit();
  InfluenceError influence_error() const { return cut_error_.summary(); }
  /// Between the file's surface and the exact ones that push() was given; zeros: none.
  DistanceSummary surface_error() const { return surface_error_.summary(); }
  size_t frames() const { return tracks_.frames(); }

 private:
  void measure_cut(const PosedSkeleton& posed);
  void measure_surface(const PosedSkeleton& posed, const Points& surface);

  std::string path_;
  Mesh mesh_;
  Joints rest_;
  GlbOptions options_;
  RigConvention rig_;
  glb::Tracks tracks_;
  Influences influences_;
  SkinWeights lost_;  ///< the file's weights minus the given ones
  std::vector<double> confidence_;
  std::vector<int64_t> filled_;
  std::optional<GlbMorphs> morphs_;
  Distances cut_error_, surface_error_;
};

}  // namespace restage
