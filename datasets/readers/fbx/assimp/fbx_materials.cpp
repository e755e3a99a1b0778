// Materials and their pictures.
#include <assimp/material.h>

#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/fbx/assimp/fbx_detail.h"
#include "datasets/readers/text/text.h"

namespace restage::fbx {
namespace {

namespace fs = std::filesystem;

/// glTF holds these two.
std::string kind_of_picture(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n")) return "image/png";
  return bytes.starts_with("\xFF\xD8\xFF") ? "image/jpeg" : "";
}

bool is_color(const aiColor3D& c) {
  return c.r >= 0 && c.g >= 0 && c.b >= 0 && c.r < 1e6f && c.g < 1e6f && c.b < 1e6f;
}

std::array<double, 3> clamped(const aiColor3D& c) {
  return {std::min(1.0, double{c.r}), std::min(1.0, double{c.g}), std::min(1.0, double{c.b})};
}

}  // namespace

/// What a texture's name stands for: a picture in the file, else a file in the FBX's folder, where
/// it is named or by its bare name (FBX often holds paths of another computer). Empty: neither.
std::string Maker::picture_bytes(const std::string& name) const {
  if (const aiTexture* inside = scene_.GetEmbeddedTexture(name.c_str())) {
    if (inside->mHeight != 0 || inside->pcData == nullptr) return "";  // bare pixels: never in FBX
    return {reinterpret_cast<const char*>(inside->pcData), inside->mWidth};
  }
  std::string plain = name;
  std::replace(plain.begin(), plain.end(), '\\', '/');
  if (plain.empty() || plain.find('\0') != plain.npos) return "";
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(path_, error).parent_path(), error);
  const fs::path bare = fs::path(plain).filename();
  const fs::path places[] = {plain, bare, fs::path(path_).stem().concat(".fbm") / bare,
                             "textures" / bare, "Textures" / bare};
  for (const fs::path& place : places) {
    const fs::path file = fs::weakly_canonical(folder / place, error);
    const fs::path inside = file.lexically_relative(folder);
    if (error || inside.empty() || *inside.begin() == ".." || inside == ".") continue;
    if (fs::is_regular_file(file, error)) return read_file(file.string());
  }
  return "";
}

/// The number of the texture, -1: left out.
int Maker::image_of(const std::string& name) {
  const auto known = textures_.find(name);
  if (known != textures_.end()) return known->second;
  int& out = textures_[name] = -1;
  const std::string bytes = picture_bytes(name);
  const std::string kind = kind_of_picture(bytes);
  if (kind.empty()) {
    remarks.push_back("left out the picture " + text::quote(name) +
                      (bytes.empty() ? ", which is neither in the file nor in its folder"
                                     : ", which is neither PNG nor JPEG"));
    return out;
  }
  const aiTexture* inside = scene_.GetEmbeddedTexture(name.c_str());
  std::string title = inside != nullptr ? inside->mFilename.C_Str() : name;
  title = title.substr(title.find_last_of("/\\") + 1);
  if (title.empty() || !text::is_utf8(title)) title = cat("picture ", textures_.size());
  json_["images"].push_back(
      {{"name", title}, {"mimeType", kind}, {"bufferView", add_view(bytes.data(), bytes.size())}});
  json_["textures"].push_back({{"source", json_["images"].size() - 1}});
  return out = static_cast<int>(json_["textures"].size()) - 1;
}

int Maker::texture_of(const aiMaterial& material, std::initializer_list<aiTextureType> kinds,
                      unsigned* coordinates) {
  for (const aiTextureType kind : kinds) {
    aiString name;
    *coordinates = 0;
    if (material.GetTexture(kind, 0, &name, nullptr, coordinates) != aiReturn_SUCCESS) continue;
    if (const int out = image_of(std::string(name.C_Str(), name.length)); out >= 0) return out;
  }
  return -1;
}

void Maker::add_materials() {
  for (unsigned m = 0; m < scene_.mNumMaterials; ++m) {
    const aiMaterial& material = *scene_.mMaterials[m];
    aiString name;
    material.Get(AI_MATKEY_NAME, name);
    Json item = {{"name", text::is_utf8(name.C_Str()) ? name.C_Str() : cat("material ", m)}};
    unsigned set = 0;
    const auto use = [&](Json& at, const char* key, int texture) {
      at[key] = {{"index", texture}};
      if (set > 0) at[key]["texCoord"] = set;
    };
    Json shading = {{"metallicFactor", 0}, {"roughnessFactor", 0.8}};
    // A picture stands for the colour, not beside it.
    std::array<double, 3> color = {1, 1, 1};
    const int picture =
        texture_of(material, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, &set);
    aiColor3D diffuse(1, 1, 1);
    if (picture >= 0)
      use(shading, "baseColorTexture", picture);
    else if (material.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == aiReturn_SUCCESS &&
             is_color(diffuse))
      color = clamped(diffuse);
    float opacity = 1;
    material.Get(AI_MATKEY_OPACITY, opacity);
    // Exporters that mix up opacity and transparency say 0 for what is to be seen.
    const bool clear = opacity > 0 && opacity < 1;
    shading["baseColorFactor"] = {color[0], color[1], color[2], clear ? double{opacity} : 1.0};
    item["pbrMetallicRoughness"] = std::move(shading);
    if (const int normals =
            texture_of(material, {aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA}, &set);
        normals >= 0)
      use(item, "normalTexture", normals);
    aiColor3D glow(0, 0, 0);
    material.Get(AI_MATKEY_COLOR_EMISSIVE, glow);
    const int glowing =
        texture_of(material, {aiTextureType_EMISSIVE, aiTextureType_EMISSION_COLOR}, &set);
    if (glowing >= 0) {
      use(item, "emissiveTexture", glowing);
      item["emissiveFactor"] = {1, 1, 1};
    } else if (is_color(glow) && !glow.IsBlack()) {
      item["emissiveFactor"] = clamped(glow);
    }
    const bool holes =
        picture >= 0 && texture_of(material, {aiTextureType_OPACITY}, &set) == picture;
    if (clear || holes) item["alphaMode"] = "BLEND";
    item["doubleSided"] = true;  // FBX knows no single-sided materials
    json_["materials"].push_back(std::move(item));
  }
}

}  // namespace restage::fbx
