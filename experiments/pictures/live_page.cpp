#include "experiments/pictures/live_page.h"

#include <filesystem>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "datasets/readers/gltf/gltf_look.h"
#include "experiments/pictures/view.h"
#include "infer/render/page.h"

namespace restage {
namespace {

constexpr int32_t kNoVertex = -1;

struct LiveClip {
  Clip clip;  ///< one frame: the target at rest
  /// Of each vertex of `clip` the vertex of the target; empty: they are the same. Where looks cut a
  /// surface apart, the clip has more vertices than the target.
  std::vector<int32_t> vertex;
};

/// Of each vertex of `look` the vertex of `target`, which is read from the same file: looks cut
/// some vertices apart. Vertices of meshes that no skin moves have none.
std::vector<int32_t> vertices_in(const Gltf& target, const Gltf& look) {
  std::map<std::pair<int, size_t>, GltfPart> parts;
  for (const GltfPart& part : target.parts) parts.insert({{part.node, part.primitive}, part});
  std::vector<int32_t> out(look.vertices.size(), kNoVertex);
  for (const GltfPart& part : look.parts) {
    const auto same = parts.find({part.node, part.primitive});
    if (same == parts.end()) continue;
    for (size_t k = 0; k < std::min(part.count, same->second.count); ++k)
      out[part.first + k] = static_cast<int32_t>(same->second.first + k);
  }
  return out;
}

/// The elements of `list` that are kept; an empty list stays empty.
template <class Value>
std::vector<Value> chosen(const std::vector<Value>& list, const std::vector<int32_t>& kept) {
  std::vector<Value> out;
  if (!list.empty())
    for (const int32_t v : kept) out.push_back(list[static_cast<size_t>(v)]);
  return out;
}

/// The clip and its look in the vertices that the target has too.
LiveClip dressed_clip(const GltfLook& look, const Appearance& all, const std::vector<int32_t>& from,
                      const Points& rest) {
  LiveClip out;
  std::vector<int32_t> kept, place(from.size(), kNoVertex);
  for (size_t v = 0; v < from.size(); ++v) {
    if (from[v] == kNoVertex) continue;
    place[v] = static_cast<int32_t>(kept.size());
    kept.push_back(static_cast<int32_t>(v));
  }
  Appearance wears = all;
  wears.uv = chosen(all.uv, kept);
  wears.colours = chosen(all.colours, kept);
  wears.smooth.clear();
  for (const int32_t v : chosen(all.smooth, kept)) wears.smooth.push_back(place[v]);
  wears.material.clear();
  for (size_t f = 0; f < look.file.faces.size(); ++f) {
    Triangle face = look.file.faces[f];
    for (int32_t& v : face) v = place[v];
    if (face[0] < 0 || face[1] < 0 || face[2] < 0) continue;
    out.clip.faces.push_back(face);
    wears.material.push_back(all.material[f]);
  }
  out.vertex = chosen(from, kept);
  out.clip.frames.push_back(chosen(rest, out.vertex));
  out.clip.look = std::make_shared<const Appearance>(std::move(wears));
  std::vector<int32_t> same(rest.size());
  std::iota(same.begin(), same.end(), 0);
  if (out.vertex == same) out.vertex.clear();
  return out;
}

LiveClip live_clip(const std::string& path, const Mesh& rest) {
  LiveClip out;
  if (is_gltf_name(path) && !rest.faces.empty()) {
    const std::string content = read_gltf_bytes(path);
    const Gltf target = parse_gltf(content, path);
    GltfLook look = parse_gltf_look(content, path);
    const auto worn = appearance_of(look);
    if (worn && target.vertices.size() == rest.vertices.size())
      out = dressed_clip(look, *worn, vertices_in(target, look.file), rest.vertices);
  }
  if (!out.clip.look) {
    out.clip.faces = rest.faces;
    out.clip.frames.push_back(rest.vertices);
  }
  // A file may have its character anywhere; whoever moves stands on the ground.
  const float floor = clip_floor(out.clip);
  for (Point& p : out.clip.frames[0]) p.y() -= floor;
  out.clip.label = std::filesystem::path(path).filename().string();
  return out;
}

}  // namespace

std::string live_page(const std::string& path, const Mesh& rest) {
  const LiveClip live = live_clip(path, rest);
  const size_t all = std::numeric_limits<size_t>::max();
  return page_html({live.clip}, {.title = "restage stream",
                                 .max_bytes = all,
                                 .max_points = all,
                                 .live = true,
                                 .live_vertex = live.vertex,
                                 .sent = rest.vertices.size()});
}

}  // namespace restage
