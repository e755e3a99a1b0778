#include <algorithm>

#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/obj_lines.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

template <class Where>
Point parse_vertex(std::string_view line, const Vec3& origin, NonFinite how, const Where& where) {
  Point point;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = text::take_word(line);
    double value = 0;
    if (word.empty())
      throw InputError(where(), "a vertex has fewer than 3 coordinates", "export the file again");
    if (!text::parse(word, value)) text::throw_no_number(word, where());
    point[axis] = text::coordinate(value - origin[axis], where, how);
  }
  return point;
}

/// "7", "7/1", "7//3", "7/1/3" or negative (counted back from the last vertex so far): 0-based.
template <class Where>
int32_t parse_corner(std::string_view word, size_t vertices, const Where& where) {
  int64_t index = 0;
  if (!text::parse(word.substr(0, word.find('/')), index))
    throw InputError(where(), text::quote(word) + " is no face corner", "export the file again");
  const int64_t zero_based = index < 0 ? static_cast<int64_t>(vertices) + index : index - 1;
  if (zero_based < 0 || zero_based > 0x7fffffff)
    throw InputError(where(),
                     cat("face index ", index, " is out of range (", vertices, " vertices so far)"),
                     "correct the face");
  return static_cast<int32_t>(zero_based);
}

}  // namespace

Mesh parse_obj(std::string_view content, const std::string& path, const Vec3& origin,
               NonFinite how) {
  content = text::without_mark(content, path);
  std::string with_ends;  // lines of old Macintosh programs end with CR alone
  if (content.find('\n') == std::string_view::npos &&
      content.find('\r') != std::string_view::npos) {
    with_ends = content;
    std::replace(with_ends.begin(), with_ends.end(), '\r', '\n');
    content = with_ends;
  }
  Mesh mesh;
  ObjLines lines(content);
  std::string_view line;
  std::vector<int32_t> corners;
  while (lines.next(line)) {
    const std::string_view keyword = text::take_word(line);
    if (keyword != "v" && keyword != "f") continue;  // normals, groups, lines, comments
    const auto where = [&] { return cat(path, ":", lines.number()); };
    if (keyword == "v") {
      mesh.vertices.push_back(parse_vertex(line, origin, how, where));
      continue;
    }
    corners.clear();
    for (std::string_view word = text::take_word(line); !word.empty() && word[0] != '#';
         word = text::take_word(line))
      corners.push_back(parse_corner(word, mesh.vertices.size(), where));
    text::add_fan(corners, corners.size(), mesh.faces);
  }
  return mesh;
}

}  // namespace restage
