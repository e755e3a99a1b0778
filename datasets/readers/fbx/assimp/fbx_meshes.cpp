// Meshes, skins and morph targets. Assimp gives a vertex for each corner of a face; those that
// agree in everything are one again.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

#include "datasets/readers/errors.h"
#include "datasets/readers/fbx/assimp/fbx_detail.h"
#include "datasets/readers/text/text.h"

namespace restage::fbx {
namespace {

constexpr size_t kSets = 4;  // of four weights, which the reader takes

/// An attribute: `width` numbers a vertex.
struct Attribute {
  std::string name;
  const char* type;
  size_t width;
  std::vector<float> values;
  int target = -1;  ///< of a morph target: which
};

void append(std::vector<float>& out, const aiVector3D& v) {
  out.insert(out.end(), {v.x, v.y, v.z});
}

Attribute vectors(const std::string& name, const aiVector3D* from, const aiVector3D* minus,
                  unsigned count, int target = -1) {
  Attribute out{name, "VEC3", 3, {}, target};
  for (unsigned v = 0; v < count; ++v) append(out.values, minus ? from[v] - minus[v] : from[v]);
  return out;
}

/// Unit length, as glTF wants it; a normal that is none points up.
void normalize(std::vector<float>& xyz) {
  for (size_t i = 0; i + 2 < xyz.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> v(&xyz[i]);
    const float length = v.norm();
    if (length > 1e-12f && std::isfinite(length))
      v /= length;
    else
      v = Eigen::Vector3f::UnitY();
  }
}

bool is_zero(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float x) { return x == 0.0f; });
}

std::vector<Attribute> attributes_of(const aiMesh& mesh) {
  const unsigned count = mesh.mNumVertices;
  std::vector<Attribute> out = {vectors("POSITION", mesh.mVertices, nullptr, count)};
  if (mesh.mNormals != nullptr) {
    out.push_back(vectors("NORMAL", mesh.mNormals, nullptr, count));
    normalize(out.back().values);
  }
  for (unsigned set = 0; set < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh.mTextureCoords[set]; ++set) {
    Attribute& uv = out.emplace_back(Attribute{cat("TEXCOORD_", set), "VEC2", 2, {}});
    for (unsigned v = 0; v < count; ++v)  // glTF counts from the upper edge
      uv.values.insert(uv.values.end(),
                       {mesh.mTextureCoords[set][v].x, 1.0f - mesh.mTextureCoords[set][v].y});
  }
  for (unsigned set = 0; set < AI_MAX_NUMBER_OF_COLOR_SETS && mesh.mColors[set]; ++set) {
    Attribute& color = out.emplace_back(Attribute{cat("COLOR_", set), "VEC4", 4, {}});
    for (unsigned v = 0; v < count; ++v)
      for (unsigned k = 0; k < 4; ++k)
        color.values.push_back(std::clamp(mesh.mColors[set][v][k], 0.0f, 1.0f));
  }
  for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
    const aiAnimMesh& shape = *mesh.mAnimMeshes[t];
    if (shape.mNumVertices != count || shape.mVertices == nullptr) continue;
    out.push_back(vectors("POSITION", shape.mVertices, mesh.mVertices, count, static_cast<int>(t)));
    if (shape.mNormals == nullptr || mesh.mNormals == nullptr) continue;
    Attribute normals =
        vectors("NORMAL", shape.mNormals, mesh.mNormals, count, static_cast<int>(t));
    if (!is_zero(normals.values)) out.push_back(std::move(normals));
  }
  return out;
}

}  // namespace

/// The joints of a mesh: a node and from where its vertices are stored to the node.
struct Maker::Skin {
  std::vector<int> joints;
  std::vector<float> inverse;  ///< 16 numbers a joint, column by column
  std::map<std::pair<int, std::vector<float>>, uint16_t> known;

  /// Nothing: there are more than glTF can count.
  std::optional<uint16_t> joint(int node, const Eigen::Matrix4d& offset) {
    const Eigen::Matrix4f single = offset.cast<float>();
    const std::vector<float> numbers(single.data(), single.data() + 16);
    const auto next = static_cast<uint16_t>(joints.size());
    const auto [at, is_new] = known.try_emplace({node, numbers}, next);
    if (is_new && joints.size() > std::numeric_limits<uint16_t>::max()) return std::nullopt;
    if (is_new) {
      joints.push_back(node);
      inverse.insert(inverse.end(), numbers.begin(), numbers.end());
    }
    return at->second;
  }
};

/// Bones are found by their names, as FBX's reader gives them. Of nodes of one name the one without
/// a mesh is the bone.
int Maker::find_bone(const std::string& name) const {
  int found = -1, worst = -1;
  for (size_t n = 1; n < nodes_.size(); ++n) {
    if (nodes_[n].raw != name) continue;
    if (!nodes_[n].meshes.empty()) {
      worst = static_cast<int>(n);
      continue;
    }
    if (found >= 0)
      refuse("has a skin on the bone " + text::quote(name) + ", and several nodes of that name");
    found = static_cast<int>(n);
  }
  if (found < 0) found = worst;
  if (found < 0) refuse("has a skin on the bone " + text::quote(name) + ", which it lacks");
  return found;
}

namespace {

using Influences = std::vector<std::pair<float, uint16_t>>;  // largest first

/// At most 16 a vertex, of sum 1; none where a vertex has none.
void tidy(std::vector<Influences>& vertices) {
  for (Influences& all : vertices) {
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    if (all.size() > 4 * kSets) all.resize(4 * kSets);
    double sum = 0;
    for (const auto& [weight, joint] : all) sum += weight;
    for (auto& [weight, joint] : all) weight = static_cast<float>(weight / sum);
  }
}

/// Which vertices are kept, and which of those each vertex is.
struct Welded {
  std::vector<uint32_t> kept, place;
};

Welded weld(const std::vector<Attribute>& attributes, const std::vector<Influences>& influences,
            size_t count) {
  Welded out;
  std::unordered_map<std::string, uint32_t> known;
  for (size_t v = 0; v < count; ++v) {
    std::string key;
    for (const Attribute& a : attributes)
      key.append(reinterpret_cast<const char*>(&a.values[a.width * v]), a.width * sizeof(float));
    if (!influences.empty())
      for (const auto& [weight, joint] : influences[v]) {
        key.append(reinterpret_cast<const char*>(&weight), sizeof(weight));
        key.append(reinterpret_cast<const char*>(&joint), sizeof(joint));
      }
    const auto [at, is_new] = known.try_emplace(key, static_cast<uint32_t>(out.kept.size()));
    if (is_new) out.kept.push_back(static_cast<uint32_t>(v));
    out.place.push_back(at->second);
  }
  return out;
}

}  // namespace

/// `skin`: of the node; nullptr where its meshes have none.
Json Maker::primitive_of(const aiMesh& mesh, const Node& node, size_t targets, Skin* skin) {
  const size_t count = mesh.mNumVertices;
  std::vector<Attribute> attributes = attributes_of(mesh);
  std::vector<Influences> influences(skin != nullptr ? count : 0);
  for (unsigned b = 0; skin != nullptr && b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    if (bone.mNumWeights == 0) continue;
    const std::optional<uint16_t> found =
        skin->joint(find_bone(std::string(bone.mName.C_Str(), bone.mName.length)),
                    matrix_of(bone.mOffsetMatrix) * node.geometry);
    if (!found) refuse("has a skin of more than 65,535 bones");
    const uint16_t joint = *found;
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const aiVertexWeight& one = bone.mWeights[w];
      if (one.mVertexId >= count || !std::isfinite(one.mWeight)) refuse("has a broken skin");
      if (!(one.mWeight > 0)) continue;
      Influences& all = influences[one.mVertexId];
      const auto same = std::find_if(all.begin(), all.end(),
                                     [&](const auto& other) { return other.second == joint; });
      if (same == all.end())
        all.emplace_back(one.mWeight, joint);
      else
        same->first += one.mWeight;
    }
  }
  // What no bone moves is moved by the mesh's own node.
  for (Influences& all : influences) {
    if (!all.empty()) continue;
    const auto own = skin->joint(static_cast<int>(&node - nodes_.data()), node.geometry);
    if (!own) refuse("has a skin of more than 65,535 bones");
    all.emplace_back(1.0f, *own);
  }
  tidy(influences);
  const Welded welded = weld(attributes, influences, count);

  Json out = {{"attributes", Json::object()}};
  std::vector<Json> shapes(targets, Json::object());
  for (Attribute& a : attributes) {
    std::vector<float> values;
    for (const uint32_t v : welded.kept)
      for (size_t k = 0; k < a.width; ++k) values.push_back(a.values[a.width * v + k]);
    const int accessor = add(values, kFloat, a.type, a.width);
    if (a.name == "POSITION") set_bounds(accessor, values, 3);
    (a.target < 0 ? out["attributes"] : shapes[static_cast<size_t>(a.target)])[a.name] = accessor;
  }
  for (Json& shape : shapes) {
    if (shape.contains("POSITION")) continue;
    const std::vector<float> none(3 * welded.kept.size());
    shape["POSITION"] = add(none, kFloat, "VEC3", 3);
    set_bounds(shape["POSITION"].get<int>(), none, 3);
  }
  if (targets > 0) out["targets"] = shapes;
  size_t most = 0;
  for (const Influences& all : influences) most = std::max(most, all.size());
  for (size_t set = 0; 4 * set < most; ++set) {
    std::vector<uint16_t> joints;
    std::vector<float> weights;
    for (const uint32_t v : welded.kept)
      for (size_t k = 4 * set; k < 4 * set + 4; ++k) {
        const bool there = k < influences[v].size();
        joints.push_back(there ? influences[v][k].second : uint16_t{0});
        weights.push_back(there ? influences[v][k].first : 0.0f);
      }
    out["attributes"][cat("JOINTS_", set)] = add(joints, kShort, "VEC4", 4);
    out["attributes"][cat("WEIGHTS_", set)] = add(weights, kFloat, "VEC4", 4);
  }
  std::vector<uint32_t> corners;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    for (unsigned k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= count) refuse("has a face without a corner");
      corners.push_back(welded.place[face.mIndices[k]]);
    }
  }
  if (corners.empty()) return nullptr;
  out["indices"] = add(corners, kInteger, "SCALAR", 1);
  if (mesh.mMaterialIndex < scene_.mNumMaterials) out["material"] = mesh.mMaterialIndex;
  return out;
}

void Maker::add_meshes() {
  const size_t count = nodes_.size();
  for (size_t n = 0; n < count; ++n) {
    const Node& node = nodes_[n];
    Json primitives = Json::array(), names = Json::array();
    Skin skin;
    bool skinned = false;
    size_t targets = 0;
    std::string name = node.name;
    for (const unsigned m : node.meshes) {
      const aiMesh& mesh = *scene_.mMeshes[m];
      skinned = skinned || mesh.mNumBones > 0;
      if (mesh.mName.length > 0 && text::is_utf8(mesh.mName.C_Str())) name = mesh.mName.C_Str();
      for (size_t t = targets; t < mesh.mNumAnimMeshes; ++t)
        names.push_back(text::is_utf8(mesh.mAnimMeshes[t]->mName.C_Str())
                            ? mesh.mAnimMeshes[t]->mName.C_Str()
                            : cat("target ", t));
      targets = std::max<size_t>(targets, mesh.mNumAnimMeshes);
    }
    for (const unsigned m : node.meshes) {
      const aiMesh& mesh = *scene_.mMeshes[m];
      if (mesh.mNumVertices == 0) continue;
      Json primitive = primitive_of(mesh, node, targets, skinned ? &skin : nullptr);
      if (!primitive.is_null()) primitives.push_back(std::move(primitive));
    }
    if (primitives.empty()) continue;
    Json item = {{"name", name}, {"primitives", primitives}};
    if (targets > 0) item["extras"] = {{"targetNames", names}};
    if (targets > 0) item["weights"] = std::vector<int>(targets, 0);
    json_["meshes"].push_back(std::move(item));
    size_t wearer = n;
    if (!skinned && !node.geometry.isIdentity(0)) {
      // The geometric transform is not for what hangs on the node.
      const Trs trs = trs_of(node.geometry);
      wearer = json_["nodes"].size();
      json_["nodes"].push_back(
          {{"name", node.name + "_geometry"},
           {"translation", {trs.translation.x(), trs.translation.y(), trs.translation.z()}},
           {"rotation", {trs.rotation.x(), trs.rotation.y(), trs.rotation.z(), trs.rotation.w()}},
           {"scale", {trs.scale.x(), trs.scale.y(), trs.scale.z()}}});
      json_["nodes"][n]["children"].push_back(wearer);
    }
    json_["nodes"][wearer]["mesh"] = json_["meshes"].size() - 1;
    nodes_[n].wearer = static_cast<int>(wearer);
    nodes_[n].targets = targets;
    if (!skinned) continue;
    json_["nodes"][wearer]["skin"] = json_["skins"].size();
    json_["skins"].push_back(
        {{"joints", skin.joints}, {"inverseBindMatrices", add(skin.inverse, kFloat, "MAT4", 16)}});
  }
}

}  // namespace restage::fbx
