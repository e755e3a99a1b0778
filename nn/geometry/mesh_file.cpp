#include "nn/geometry/mesh_file.h"

#include <bit>
#include <cstdio>

#include "autograd/base/error.h"

namespace restage {
namespace {

// Files are little-endian; so is every machine this builds for.
static_assert(std::endian::native == std::endian::little);

// What we write begins with this where it has the comment.
constexpr const char* kPlyStart = "ply\nformat binary_little_endian 1.0\n";
constexpr const char* kPlyComment = "comment restage, metres, y up\n";
constexpr const char* kObjComment = "# restage, metres, y up\n";

template <class T>
void append(std::string& bytes, const T* values, size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

}  // namespace

const char* extension(MeshFormat format) { return format == MeshFormat::ply ? "ply" : "obj"; }

std::string ply_bytes(const Points& vertices, const std::vector<Triangle>& faces, bool comment) {
  std::string bytes = kPlyStart;
  if (comment) bytes += kPlyComment;
  bytes += "element vertex " + std::to_string(vertices.size()) + "\n";
  bytes += "property float x\nproperty float y\nproperty float z\n";
  if (!faces.empty())
    bytes += "element face " + std::to_string(faces.size()) +
             "\nproperty list uchar int vertex_indices\n";
  bytes += "end_header\n";
  bytes.reserve(bytes.size() + vertices.size() * 12 + faces.size() * 13);
  for (const Point& p : vertices) append(bytes, p.data(), 3);
  for (const Triangle& face : faces) {
    bytes.push_back(3);
    append(bytes, face.data(), 3);
  }
  return bytes;
}

std::string obj_bytes(const Points& vertices, const std::vector<Triangle>& faces, bool comment) {
  std::string text = comment ? kObjComment : "";
  text.reserve(vertices.size() * 40 + faces.size() * 24);
  char line[96];
  for (const Point& p : vertices) {
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", static_cast<double>(p.x()),
                  static_cast<double>(p.y()), static_cast<double>(p.z()));
    text += line;
  }
  for (const Triangle& f : faces) {
    std::snprintf(line, sizeof line, "f %d %d %d\n", f[0] + 1, f[1] + 1, f[2] + 1);
    text += line;
  }
  return text;
}

std::string mesh_bytes(MeshFormat format, const Points& vertices,
                       const std::vector<Triangle>& faces) {
  return format == MeshFormat::ply ? ply_bytes(vertices, faces) : obj_bytes(vertices, faces);
}

std::string comment_of(MeshFormat format) {
  return format == MeshFormat::ply ? kPlyComment : kObjComment;
}

bool is_ours(MeshFormat format, const std::string& head) {
  if (format == MeshFormat::obj) return head.starts_with(kObjComment);
  // "ply", the format's line, the comment
  const size_t line = head.starts_with("ply\nformat ") ? head.find('\n', 4) : head.npos;
  return line != head.npos && std::string_view(head).substr(line + 1).starts_with(kPlyComment);
}

void check_mesh(const std::string& where, const Points& vertices,
                const std::vector<Triangle>& faces) {
  if (vertices.empty())
    throw InputError(where, "the mesh has no vertices", "give a target with some");
  for (size_t v = 0; v < vertices.size(); ++v)
    if (!vertices[v].allFinite())
      throw InputError(where, "vertex " + std::to_string(v) + " is not a finite number",
                       "mend the mesh or the network that posed it");
  const auto count = static_cast<int64_t>(vertices.size());
  for (size_t f = 0; f < faces.size(); ++f)
    for (const int32_t v : faces[f])
      if (v < 0 || v >= count)
        throw InputError(where,
                         "face " + std::to_string(f) + " names vertex " + std::to_string(v) +
                             " of " + std::to_string(count),
                         "mend the faces");
}

}  // namespace restage
