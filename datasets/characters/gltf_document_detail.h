// What the files of GltfDocument share: its structure and its bytes.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "datasets/characters/gltf_document.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_detail.h"

namespace restage {
namespace gltf_document {

using Json = nlohmann::ordered_json;

/// Runs what reads parts of the structure that read_gltf() does not look at. InputError if they are
/// of another kind than the format says.
template <class Work>
auto checked_kinds(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const Json::exception&) {
  } catch (const std::out_of_range&) {
  }
  gltf::broken(path, "has parts that are no glTF");
}

inline bool is_external(const Json& item) {
  return item.contains("uri") && !item["uri"].get_ref<const std::string&>().starts_with("data:");
}

inline void pad(std::string& bytes) { bytes.resize((bytes.size() + 3) / 4 * 4, '\0'); }

}  // namespace gltf_document

struct GltfDocument::State {
  using Json = gltf_document::Json;
  std::string path;
  Json json;
  std::string binary;  ///< of a GLB: the bytes of buffer 0, without an address
  bool has_binary = false;
  std::string added;  ///< of a text: the bytes of the new animation

  /// A list of the document, which becomes an empty one where there is none.
  Json& list(const char* name) {
    Json& out = json[name];
    if (out.is_null()) out = Json::array();
    if (!out.is_array()) gltf::broken(path, cat("has ", name, " that are no list"));
    return out;
  }

  /// The files that the document names.
  std::vector<std::string> externals() const {
    return gltf_document::checked_kinds(path, [&] { return list_externals(); });
  }
  std::vector<std::string> list_externals() const {
    std::vector<std::string> out;
    for (const char* name : {"buffers", "images"})
      if (json.contains(name))
        for (const Json& item : json[name])
          if (gltf_document::is_external(item)) out.push_back(item["uri"].get<std::string>());
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }

  /// Where in the new animation's buffer these bytes begin.
  static size_t put(std::string& bytes, const void* data, size_t size) {
    const size_t at = bytes.size();
    bytes.append(static_cast<const char*>(data), size);
    gltf_document::pad(bytes);
    return at;
  }

  /// The bytes of a buffer of the document.
  std::string buffer(size_t number) const;
  Json as_binary(std::string* bytes) const;
  Json as_text() const;
};

/// Gives meshes morph targets, and the last animation their weights (GltfDocument::Bulge).
class GltfDocument::Bulger {
 public:
  using Json = gltf_document::Json;
  /// `buffer`: where bytes that are added belong. `vertex`: of each vertex of the document's meshes
  /// the one of `bulge`; empty: the same.
  Bulger(State& state, const Bulge& bulge, size_t buffer, std::vector<int32_t> vertex);
  /// The parts of one mesh, which the node shows.
  void add(size_t node, size_t mesh, const std::vector<GltfPart>& parts);
  /// After the animation was added.
  void end();

 private:
  struct Wearer {
    size_t node;
    std::vector<float> before;  ///< the weights at rest of the targets that were there
  };
  size_t add(const std::string& bytes, Json accessor, int stride);
  /// Three numbers a vertex, whose largest possible one stands for 1.
  template <class T>
  size_t target(const GltfPart& part, int kind, const std::vector<T>& numbers);
  size_t nothing(size_t count);
  void name_targets(Json& mesh, size_t before);
  void widen(const Wearer& wearer, Json& animation);
  size_t weights_of(const Wearer& wearer);

  State& s_;
  const Bulge& bulge_;
  const size_t buffer_;
  const std::vector<int32_t> vertex_;
  std::vector<int16_t> mean_;  ///< of Bulge::mean, in shares of `largest_`
  float largest_ = 0;
  std::vector<Wearer> wearers_;
};

}  // namespace restage
