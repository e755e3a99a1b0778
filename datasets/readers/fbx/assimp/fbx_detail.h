// Shared by the files of this folder only: the document that is made of an FBX scene.
#pragma once

#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace restage::fbx {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kInteger = 5125, kShort = 5123;  // glTF's component types

/// A glTF node. FBX says where a node is by up to a dozen parts (pivots, offsets, rotations before
/// and after); Assimp makes each a node of its own, here they are one again.
struct Node {
  std::string name;
  std::string raw;  ///< as FBX has it, in whatever encoding; bones and channels are called so
  int parent = -1;
  /// What the local transform is a product of; the last one is the node itself.
  std::vector<const aiNode*> chain;
  Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
  /// From the space of the node's meshes to the node: FBX's geometric transform, which children do
  /// not inherit.
  Eigen::Matrix4d geometry = Eigen::Matrix4d::Identity();
  std::vector<unsigned> meshes;  ///< of the scene
  int wearer = -1;               ///< the number of the node that got the meshes; -1: none
  size_t targets = 0;            ///< morph targets of its mesh
};

/// Translation, rotation and scale of a matrix; shear, which glTF's nodes cannot have, is left out.
struct Trs {
  Eigen::Vector3d translation;
  Eigen::Quaterniond rotation;
  Eigen::Vector3d scale;
};
Trs trs_of(const Eigen::Matrix4d& matrix);
Eigen::Matrix4d matrix_of(const aiMatrix4x4& m);

/// The document while it is made.
class Maker {
 public:
  Maker(const aiScene& scene, const std::string& path) : scene_(scene), path_(path) {}

  /// Everything; call once.
  std::string make();
  std::vector<std::string> remarks;

 private:
  // fbx_scene.cpp
  void add_nodes(const aiNode& from, int parent, std::vector<const aiNode*> chain,
                 Eigen::Matrix4d geometry);
  void write_nodes();
  Eigen::Matrix4d root_transform() const;
  [[noreturn]] void refuse(const std::string& what) const;
  int add_view(const void* data, size_t bytes);
  /// `width` numbers an element; InputError for floats that are not finite.
  template <class T>
  int add(const std::vector<T>& values, int component, const char* type, size_t width) {
    if constexpr (std::is_same_v<T, float>) check_finite(values);
    const int view = add_view(values.data(), values.size() * sizeof(T));
    json_["accessors"].push_back({{"bufferView", view},
                                  {"componentType", component},
                                  {"count", values.size() / width},
                                  {"type", type}});
    return static_cast<int>(json_["accessors"].size()) - 1;
  }
  void check_finite(const std::vector<float>& values) const;
  void set_bounds(int accessor, const std::vector<float>& values, size_t width);

  // fbx_meshes.cpp
  struct Skin;
  void add_meshes();
  Json primitive_of(const aiMesh& mesh, const Node& node, size_t targets, Skin* skin);
  int find_bone(const std::string& name) const;

  // fbx_materials.cpp
  void add_materials();
  int texture_of(const aiMaterial& material, std::initializer_list<aiTextureType> kinds,
                 unsigned* coordinates);
  int image_of(const std::string& name);
  std::string picture_bytes(const std::string& name) const;

  // fbx_animations.cpp
  void add_animations();
  void add_turns(const aiAnimation& animation, Json& out);
  void add_weights(const aiAnimation& animation, Json& out);
  void add_channel(Json& out, int node, const char* path, int input, int output) const;
  int add_times(const std::vector<double>& seconds);

  const aiScene& scene_;
  const std::string& path_;
  std::vector<Node> nodes_;
  Json json_;
  std::string binary_;
  std::map<std::string, int> textures_;  ///< by the name that materials use; -1: left out
};

}  // namespace restage::fbx
