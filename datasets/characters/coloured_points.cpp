#include "datasets/characters/coloured_points.h"

#include <algorithm>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/obj_lines.h"

namespace restage {
namespace {

using PointRgba = std::array<float, 4>;

/// Of an OBJ file; 0 to 1, or 0 to 255 as some programs write them.
std::vector<PointRgba> obj_colours(std::string_view content) {
  std::vector<PointRgba> out;
  float largest = 0;
  ObjLines lines(content);
  for (std::string_view line; lines.next(line);) {
    std::string_view rest = line;
    if (text::take_word(rest) != "v") continue;
    for (int k = 0; k < 3; ++k) text::take_word(rest);
    PointRgba colour{0, 0, 0, 1};
    for (size_t k = 0; k < 3; ++k) {
      double x = 0;
      if (!text::parse(text::take_word(rest), x)) return {};
      colour[k] = static_cast<float>(x);
      largest = std::max(largest, colour[k]);
    }
    out.push_back(colour);
  }
  for (PointRgba& colour : out)
    for (size_t k = 0; k < 3 && largest > 1; ++k) colour[k] /= 255.0f;
  return out;
}

}  // namespace

std::optional<ColouredPoints> read_coloured_points(const std::string& path) {
  const bool obj = text::ends_in(path, {".obj"});
  if (!obj && !text::ends_in(path, {".ply"})) return {};
  const std::string content = read_file(path);
  const std::string_view words = text::without_mark(content, path);
  std::vector<PointRgba> colours;
  const Mesh mesh = obj ? parse_obj(words, path, Vec3::Zero(), NonFinite::mark)
                        : parse_ply(words, path, Vec3::Zero(), NonFinite::mark, &colours);
  if (obj) colours = obj_colours(words);
  if (colours.empty() || colours.size() != mesh.vertices.size()) return {};
  ColouredPoints out;
  for (size_t i = 0; i < colours.size(); ++i) {
    if (!mesh.vertices[i].allFinite()) continue;
    out.points.push_back(mesh.vertices[i]);
    out.colours.push_back({colours[i][0], colours[i][1], colours[i][2]});
  }
  return out;
}

}  // namespace restage
