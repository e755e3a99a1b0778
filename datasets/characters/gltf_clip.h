// The document of a glTF character with one animation more: all else is what it was.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/characters/gltf_document.h"
#include "datasets/importers/rigs/gltf_own_rig.h"

namespace restage {

/// Collects poses and writes the document at commit(). Nodes, meshes, skins, materials, pictures,
/// morph targets, extensions and earlier animations are the input's; of a GLB, the input's binary
/// chunk begins the output's; but a node that is turned and whose place is a `matrix` gets
/// translation, rotation and scale instead. The new animation turns the nodes of the 22 joints and
/// of fingers (LINEAR, unit quaternions whose signs make curves continuous) and moves the hips and
/// bones that hang elsewhere than on the body, nothing else.
///
/// `out` ends in .glb, .vrm or .gltf. A .glb or .vrm holds everything itself, also what a .gltf
/// names as files beside it. A .gltf keeps the names of such files; where it is written into
/// another folder, the files are copied there (InputError if others of that name are there); the
/// animation's numbers are in its text. Memory: the input, and some 350 bytes a frame.
class GltfClipWriter {
 public:
  struct Options {
    std::string name = "retargeted";  ///< of the animation
    double fps = kFps;
    /// Only nodes and the new animation: no meshes, skins, materials, pictures, extensions.
    bool animation_only = false;
  };
  /// `in`: the file of `rig`. InputError where `out` cannot hold `in`.
  GltfClipWriter(std::string out, const std::string& in, std::shared_ptr<const GltfOwnRig> rig,
                 Options options);
  /// As GlbWriter::push().
  /// `fingers`: of all frames the same ones, or null in all.
  void push(const Pose& pose, std::optional<double> confidence = std::nullopt,
            const FingerTurns* fingers = nullptr);
  /// As GlbWriter::set_filled().
  void set_filled(std::vector<int64_t> frames) { filled_ = std::move(frames); }
  /// For all frames, after the last push(): as GltfDocument::bulge().
  void set_bulge(GltfDocument::Bulge bulge) { bulge_ = std::move(bulge); }
  void commit();
  size_t frames() const { return moves_.empty() ? 0 : moves_[0].second.size() / 3; }

 private:
  std::string out_, in_, content_;
  std::shared_ptr<const GltfOwnRig> rig_;
  Options options_;
  std::vector<int> nodes_;                   ///< that are turned
  std::vector<std::array<float, 4>> turns_;  ///< one (x, y, z, w) a node, frame by frame
  std::vector<std::pair<int, std::vector<float>>> moves_;  ///< nodes; 3 numbers a frame
  std::vector<double> confidence_;
  std::vector<int64_t> filled_;
  std::optional<GltfDocument::Bulge> bulge_;
};

}  // namespace restage
