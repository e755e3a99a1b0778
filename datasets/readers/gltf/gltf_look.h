// A glTF file as it is drawn: all that read_gltf() gives, with materials, pictures and morph
// targets.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "datasets/readers/gltf/gltf.h"
#include "nn/geometry/appearance.h"

namespace restage {

/// Morph targets of vertices that follow one another.
struct GltfMorphs {
  int node = 0;  ///< that shows the mesh, and whose weights count
  size_t first = 0;
  /// Per target: how far each vertex moves at weight 1. Empty: a target that is never used.
  std::vector<Points> targets;
};

/// Weights of the morph targets of a node during a clip.
struct GltfWeightTrack {
  int node = 0;
  GltfTrack::Interpolation interpolation = GltfTrack::Interpolation::linear;
  int times = 0;  ///< which of Gltf::times
  size_t targets = 0;
  std::vector<float> values;  ///< `targets` a key; cubic: in-tangents, values, out-tangents
};

struct GltfLook {
  /// With all meshes of the scene: also those that read_gltf() leaves out because they belong to
  /// no skin. Clips that only animate weights are there too.
  Gltf file;
  /// Of the vertices and faces of `file`. The last material is white, of what has none.
  Appearance look;
  std::vector<GltfMorphs> morphs;
  std::vector<std::vector<float>> weights;                  ///< per node: at rest; may be empty
  std::vector<std::vector<GltfWeightTrack>> weight_tracks;  ///< per clip of `file`
  std::vector<bool> ours;  ///< per clip of `file`: whether Restage has written it
};

/// InputError: as read_gltf(). What concerns looks alone is never an error: a texture coordinate, a
/// colour or a picture that cannot be read is left out, with a remark in `file.remarks`.
GltfLook read_gltf_look(const std::string& path);
/// The same from memory, as parse_gltf().
GltfLook parse_gltf_look(std::string_view content, const std::string& path);

/// The surface at a time of a clip, or at rest (null). `nodes`: gltf_pose() or gltf_rest().
Mesh gltf_look_mesh(const GltfLook& look, const GltfTransforms& nodes, const GltfClip* clip,
                    double seconds);

}  // namespace restage
