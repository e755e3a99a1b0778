// Assimp's import, the document's nodes and its bytes.
#include "datasets/readers/fbx/assimp/fbx_scene.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>

#include <algorithm>
#include <assimp/DefaultLogger.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <cctype>
#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/readers/fbx/assimp/fbx_detail.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/glb_file.h"

namespace restage {
namespace fbx {
namespace {

constexpr std::string_view kPart = "_$AssimpFbx$_";  // in names of nodes that are a part of one

std::string name_of(const aiString& text) {
  std::string name(text.C_Str(), text.length);
  if (text::is_utf8(name)) return name;
  for (char& c : name)  // JSON holds nothing else
    if (static_cast<unsigned char>(c) >= 128) c = '_';
  return name;
}

double number_of(const aiMetadata& data, const char* key, double otherwise) {
  int32_t whole = 0;
  float single = 0;
  double twice = 0;
  if (data.Get(key, whole)) return whole;
  if (data.Get(key, single)) return single;
  return data.Get(key, twice) ? twice : otherwise;
}

}  // namespace

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d out;
  out << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3,
      m.d4;
  return out;
}

Trs trs_of(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  Trs out{matrix.topRightCorner<3, 1>(), Eigen::Quaterniond::Identity(),
          linear.colwise().norm().transpose()};
  if (linear.determinant() < 0) out.scale.x() = -out.scale.x();
  for (double& s : out.scale)  // single precision went in
    if (std::abs(s - 1) < 1e-5) s = 1;
  if (out.scale.cwiseAbs().minCoeff() < 1e-12) return out;
  out.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(linear * out.scale.cwiseInverse().asDiagonal()));
  out.rotation.normalize();
  return out;
}

void Maker::refuse(const std::string& what) const {
  throw InputError(path_, what, "export it again, or export GLB (glTF) from Blender");
}

/// To metres, y up, facing +z: FBX says its axes and its unit in centimetres.
Eigen::Matrix4d Maker::root_transform() const {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  if (scene_.mMetaData == nullptr) return out;
  const aiMetadata& data = *scene_.mMetaData;
  const double unit = 0.01 * number_of(data, "UnitScaleFactor", 1);
  if (!(unit > 1e-9 && unit < 1e9)) refuse("has a unit that is none");
  const char* names[] = {"CoordAxis", "UpAxis", "FrontAxis"};
  const double otherwise[] = {0, 1, 2};
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (int row = 0; row < 3; ++row) {
    const double axis = number_of(data, names[row], otherwise[row]);
    if (axis != 0 && axis != 1 && axis != 2) refuse("has axes that are none");
    const double sign = number_of(data, (std::string(names[row]) + "Sign").c_str(), 1);
    axes(row, static_cast<int>(axis)) = sign < 0 ? -1 : 1;
  }
  if (std::abs(axes.determinant()) < 0.5) refuse("names one axis twice");
  out.topLeftCorner<3, 3>() = unit * axes;
  return out;
}

/// `chain`, `geometry`: what the parts above `from` have gathered for the node that they belong to.
void Maker::add_nodes(const aiNode& from, int parent, std::vector<const aiNode*> chain,
                      Eigen::Matrix4d geometry) {
  const std::string name = name_of(from.mName);
  const size_t part = name.find(kPart);
  if (part != name.npos) {
    const std::string kind = name.substr(part + kPart.size());
    if (!kind.starts_with("Geometric"))
      chain.push_back(&from);
    else if (!kind.ends_with(
                 "Inverse"))  // those undo for the children what they do not inherit here
      geometry = geometry * matrix_of(from.mTransformation);
    if (from.mNumChildren > 0 || from.mNumMeshes == 0) {
      for (unsigned c = 0; c < from.mNumChildren; ++c)
        add_nodes(*from.mChildren[c], parent, chain, geometry);
      return;
    }
  }
  Node node;
  node.name = name;
  node.raw = std::string(from.mName.C_Str(), from.mName.length);
  node.parent = parent;
  node.chain = std::move(chain);
  if (part == name.npos) node.chain.push_back(&from);
  for (const aiNode* step : node.chain) node.local = node.local * matrix_of(step->mTransformation);
  if (parent < 0) node.local = root_transform();
  node.geometry = geometry;
  node.meshes.assign(from.mMeshes, from.mMeshes + from.mNumMeshes);
  const int number = static_cast<int>(nodes_.size());
  nodes_.push_back(std::move(node));
  for (unsigned c = 0; c < from.mNumChildren; ++c)
    add_nodes(*from.mChildren[c], number, {}, Eigen::Matrix4d::Identity());
}

void Maker::write_nodes() {
  Json& list = json_["nodes"] = Json::array();
  for (const Node& node : nodes_) {
    if (!node.local.allFinite()) refuse("has a node that is nowhere: " + text::quote(node.name));
    const Trs trs = trs_of(node.local);
    Json item = {{"name", node.name}};
    if (!trs.translation.isZero(0))
      item["translation"] = {trs.translation.x(), trs.translation.y(), trs.translation.z()};
    if (!trs.rotation.isApprox(Eigen::Quaterniond::Identity(), 0))
      item["rotation"] = {trs.rotation.x(), trs.rotation.y(), trs.rotation.z(), trs.rotation.w()};
    if (!trs.scale.isOnes(0)) item["scale"] = {trs.scale.x(), trs.scale.y(), trs.scale.z()};
    list.push_back(std::move(item));
  }
  for (size_t n = 0; n < nodes_.size(); ++n)
    if (nodes_[n].parent >= 0) list[static_cast<size_t>(nodes_[n].parent)]["children"].push_back(n);
}

int Maker::add_view(const void* data, size_t bytes) {
  const size_t at = binary_.size();
  binary_.append(static_cast<const char*>(data), bytes);
  binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
  json_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes}});
  return static_cast<int>(json_["bufferViews"].size()) - 1;
}

void Maker::check_finite(const std::vector<float>& values) const {
  for (const float x : values)
    if (!std::isfinite(x)) refuse("holds NaN or infinite numbers");
}

void Maker::set_bounds(int accessor, const std::vector<float>& values, size_t width) {
  std::vector<float> least(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
  std::vector<float> most = least;
  for (size_t i = 0; i < values.size(); ++i) {
    least[i % width] = std::min(least[i % width], values[i]);
    most[i % width] = std::max(most[i % width], values[i]);
  }
  json_["accessors"][static_cast<size_t>(accessor)]["min"] = least;
  json_["accessors"][static_cast<size_t>(accessor)]["max"] = most;
}

std::string Maker::make() {
  json_["asset"] = {{"version", "2.0"}, {"generator", "restage, from FBX"}};
  json_["scene"] = 0;
  json_["scenes"] = Json::array({{{"nodes", {0}}}});
  add_nodes(*scene_.mRootNode, -1, {}, Eigen::Matrix4d::Identity());
  write_nodes();
  add_materials();
  add_meshes();
  add_animations();
  if (!binary_.empty()) json_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  return glb_bytes(json_.dump(), std::move(binary_), path_);
}

}  // namespace fbx

std::string assimp_words(std::string_view words) {
  constexpr size_t kMost = 120;
  words = words.substr(0, words.find_last_not_of(" \n") + 1);
  const size_t token = words.find("(TOK_"), end = words.find(") ", std::min(token, words.size()));
  std::string out(words);
  if (token != words.npos && end != words.npos) out.erase(token, end + 2 - token);
  for (char& c : out)
    if (c < ' ' || c > '~' || c == ';') c = '?';
  return out.size() > kMost ? out.substr(0, kMost) + "..." : out;
}

namespace {

bool is_base64(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '+' || c == '/';
}

/// A text's pictures are quoted base64. Assimp 5.2 crashes where its padding is wrong, as in files
/// that Assimp itself writes: padded anew here. What is no base64 is left out.
std::string with_sound_pictures(std::string_view text, std::vector<std::string>* remarks) {
  constexpr std::string_view kKey = "Content:", kGaps = " \t\r\n,";
  std::string out;
  while (true) {
    const size_t key = text.find(kKey);
    if (key == text.npos) return out.append(text);
    out.append(text.substr(0, key + kKey.size()));
    text.remove_prefix(key + kKey.size());
    std::string quotes;
    bool sound = true;
    for (size_t at = text.find_first_not_of(kGaps); at != text.npos && text[at] == '"';
         at = text.find_first_not_of(kGaps)) {
      const size_t end = std::min(text.find('"', at + 1), text.size());
      std::string_view letters = text.substr(at + 1, end - at - 1);
      letters = letters.substr(0, letters.find_last_not_of('=') + 1);
      sound = sound && std::all_of(letters.begin(), letters.end(), is_base64);
      if (letters.size() % 4 == 1) letters.remove_suffix(1);  // six bits are no byte
      quotes += std::string(quotes.empty() ? " \"" : ",\"") + std::string(letters) +
                std::string((4 - letters.size() % 4) % 4, '=') + '"';
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (sound)
      out += quotes;
    else
      remarks->push_back("left out a picture in the file that is no base64");
  }
}

/// What Assimp leaves out of a scene because it does not understand it.
class LeftOut : public Assimp::LogStream {
 public:
  explicit LeftOut(std::vector<std::string>* remarks) : remarks_(remarks) {}
  void write(const char* message) override {
    const std::string_view line(message);
    const size_t at = line.find("FBX-");  // "FBX-DOM", "FBX-Parser"; "FBX:" does no harm
    if (at == line.npos || remarks_->size() >= kMost) return;
    remarks_->push_back("left out a part of the file (" + assimp_words(line.substr(at)) + ")");
  }

 private:
  static constexpr size_t kMost = 5;
  std::vector<std::string>* remarks_;
};

}  // namespace

std::string fbx_to_glb(std::string_view content, const std::string& path,
                       std::vector<std::string>* remarks) {
  Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
  Assimp::DefaultLogger::get()->attachStream(new LeftOut(remarks), Assimp::Logger::Err);  // owns it
  std::string mended;
  if (!content.starts_with("Kaydara")) content = mended = with_sound_pictures(content, remarks);
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_CAMERAS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_LIGHTS, false);
  // Pictures in the file are called "*0", "*1": several may have one file name.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_EMBEDDED_TEXTURES_LEGACY_NAMING, true);
  const aiScene* scene =
      importer.ReadFileFromMemory(content.data(), content.size(), aiProcess_Triangulate, "fbx");
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
  if (scene->mRootNode == nullptr || scene->mRootNode->mNumChildren == 0)
    throw InputError(path, "holds no scene", "export it again with its character");
  fbx::Maker maker(*scene, path);
  std::string out = maker.make();
  remarks->insert(remarks->end(), maker.remarks.begin(), maker.remarks.end());
  return out;
}

}  // namespace restage
