// Rigged characters and scenes in glTF 2.0: .glb, .vrm, .vrma (VRM animations: nodes that move and
// a list of which bone they are) and .gltf with the buffers in its folder.
// What a file holds as plain values, in the file's own units and axes (metres and y up, if it keeps
// to the format). Pictures, materials, cameras and morph targets are left out
// (datasets/characters/gltf_document.h keeps them).
// Reading never trusts a number in a file. InputError "file: what; fix" for anything wrong: cut
// short, indices and ranges outside of what is there, circles of nodes, NaN, required extensions
// that change how data is stored (Draco, meshopt: with the command that unpacks them; a file that
// holds its data in plain, too, is read by those), data repeated until it would fill the memory.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct GltfNode {
  std::string name;
  int number = 0;   ///< in the file
  int parent = -1;  ///< comes before its children; -1: none
  Vec3 translation = Vec3::Zero();
  Quat rotation = Quat::Identity();
  Vec3 scale = Vec3::Ones();
  Eigen::Affine3d local() const {
    return Eigen::Affine3d().fromPositionOrientationScale(translation, rotation, scale);
  }
};

/// What moves vertices: a node, seen from the space in which the vertices are stored.
struct GltfBone {
  int node = 0;
  int skin = -1;  ///< -1: an unskinned mesh that hangs on its node
  Eigen::Affine3d inverse_bind = Eigen::Affine3d::Identity();
};

struct GltfInfluence {
  int32_t bone;
  float weight;
};

/// One animated property of a node.
struct GltfTrack {
  enum class Path { translation, rotation, scale };
  enum class Interpolation { step, linear, cubic };
  int node = 0;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  int times = 0;              ///< which of Gltf::times
  std::vector<float> values;  ///< 3 or 4 (x, y, z, w) a key; cubic: in-tangent, value, out-tangent
};

struct GltfClip {
  std::string name;
  std::vector<GltfTrack> tracks;
  double begin = 0, end = 0;  ///< seconds of the first and the last key
};

/// Which vertices are a primitive's.
struct GltfPart {
  int node;          ///< number in the file of the node that shows it
  size_t primitive;  ///< of the node's mesh
  size_t first, count;
};

struct Gltf {
  std::string path;
  uint64_t bytes = 0;  ///< of the file and its buffers
  std::vector<GltfNode> nodes;
  std::vector<GltfBone> bones;
  std::vector<int> skin_nodes;  ///< per skin: a node whose mesh wears it; -1: none does
  /// All meshes of the scene, one after the other, as stored: a vertex is in the world where its
  /// influences put it. With skins, unskinned meshes that hang on no joint are left out (remark).
  Points vertices;
  std::vector<GltfPart> parts;
  std::vector<uint32_t> first_influence;  ///< V + 1; vertex v has [v] to [v + 1)
  std::vector<GltfInfluence> influences;  ///< weights of a vertex sum to 1
  std::vector<Triangle> faces;
  std::vector<std::vector<float>> times;  ///< seconds, not falling
  std::vector<GltfClip> clips;
  std::vector<std::pair<std::string, int>> humanoid;  ///< VRM's name of a bone, and its node
  std::string standard;                               ///< "VRM 0", "VRM 1", "VRM animation" or ""
  size_t meshes = 0, morph_targets = 0;               ///< that the scene shows
  std::vector<std::string> remarks;                   ///< what was left out
};

/// Whether the name ends in .glb, .gltf, .vrm or .vrma, in any case; or in .fbx, which is read as
/// the GLB document that is made of it (datasets/readers/fbx/fbx.h).
bool is_gltf_name(const std::string& path);

Gltf read_gltf(const std::string& path);
/// The same from memory; external buffers are looked for in the folder of `path`.
Gltf parse_gltf(std::string_view content, const std::string& path);
/// The bytes of the document: the file's own; of FBX those that it is made into.
std::string read_gltf_bytes(const std::string& path, std::vector<std::string>* remarks = nullptr);

using GltfTransforms = std::vector<Eigen::Affine3d>;

/// From each node to the world, at rest or at a time of a clip (held before its begin and after
/// its end).
GltfTransforms gltf_rest(const Gltf& file);
GltfTransforms gltf_pose(const Gltf& file, const GltfClip& clip, double seconds);

/// Linear blend skinning: all vertices where the nodes put them.
Mesh gltf_mesh(const Gltf& file, const GltfTransforms& nodes);

/// The clip of this name (empty: the first). InputError with the names there are if there is none.
const GltfClip& find_clip(const Gltf& file, const std::string& name);
/// How many frames a clip has at kFps: at k / kFps seconds after its begin. InputError beyond 9 h.
int64_t clip_frames(const Gltf& file, const GltfClip& clip);

}  // namespace restage
