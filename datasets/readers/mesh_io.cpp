#include "datasets/readers/mesh_io.h"

#include <cctype>
#include <cstdio>
#include <cstring>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/readers/gltf.h"
#include "datasets/readers/obj.h"
#include "datasets/readers/ply.h"
#include "datasets/readers/precision.h"

namespace restage {
namespace {

bool ends_in(const std::string& path, const char* extension) {
  const size_t n = std::strlen(extension);
  if (path.size() < n) return false;
  for (size_t i = 0; i < n; ++i)
    if (std::tolower(static_cast<unsigned char>(path[path.size() - n + i])) != extension[i])
      return false;
  return true;
}

bool starts_as_ply(const std::string& content) {
  return content.compare(0, 4, "ply\n") == 0 || content.compare(0, 5, "ply\r\n") == 0;
}

/// A line "v ..." near the start, and no binary zeros.
bool looks_like_obj(const std::string& content) {
  const std::string head = "\n" + content.substr(0, 65536);
  return head.find('\0') == std::string::npos && head.find("\nv ") != std::string::npos;
}

void check_mesh(const Mesh& mesh, const std::string& path) {
  if (mesh.vertices.empty())
    throw InputError(path, "holds no points", "give a mesh or cloud that has some");
  for (size_t i = 0; i < mesh.faces.size(); ++i)
    for (const int32_t index : mesh.faces[i])
      if (index < 0 || static_cast<size_t>(index) >= mesh.vertices.size())
        throw InputError(path,
                         "triangle " + std::to_string(i) + " has vertex index " +
                             std::to_string(index) + " (from 0), out of range for " +
                             std::to_string(mesh.vertices.size()) + " vertices",
                         "correct the face list");
}

Mesh without_non_finite(const std::string& content, const std::string& path, const Vec3& origin,
                        size_t& left_out) {
  Mesh mesh = parse_mesh(content, path, origin, NonFinite::mark);
  left_out = leave_out_non_finite(mesh.vertices, mesh.faces);
  if (mesh.vertices.empty())
    throw InputError(path, "holds no points but NaN and infinite ones", "export it again");
  return mesh;
}

template <class T>
void add_bytes(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

bool is_mesh_name(const std::string& path) {
  return ends_in(path, ".ply") || ends_in(path, ".obj") || is_gltf_name(path);
}

Mesh read_mesh(const std::string& path) {
  Mesh mesh = parse_mesh(read_file(path), path);
  check_precision(mesh.vertices, path, "restage doctor FILE --fix OUT moves it to the origin");
  return mesh;
}

Mesh read_mesh(const std::string& path, size_t& left_out) {
  Mesh mesh = without_non_finite(read_file(path), path, Vec3::Zero(), left_out);
  check_precision(mesh.vertices, path, "restage doctor FILE --fix OUT moves it to the origin");
  return mesh;
}

Mesh read_mesh(const std::string& path, size_t& left_out, Vec3& origin) {
  const std::string content = read_file(path);
  origin.setZero();
  Mesh mesh = without_non_finite(content, path, origin, left_out);
  if (is_gltf_name(path) || !is_blurred(mesh.vertices)) return mesh;  // glTF is single precision
  origin = mesh.vertices[0].cast<double>();
  return without_non_finite(content, path, origin, left_out);
}

Mesh parse_mesh(const std::string& content, const std::string& path, const Vec3& origin,
                NonFinite how) {
  Mesh mesh;
  if (content.empty()) {
    throw InputError(path, "is empty and holds no points", "give a mesh or cloud that has some");
  } else if (is_gltf_name(path) || content.compare(0, 4, "glTF") == 0) {
    const Gltf file = parse_gltf(content, path);
    return gltf_mesh(file, gltf_rest(file));
  } else if (starts_as_ply(content)) {
    mesh = parse_ply(content, path, origin, how);
  } else if (ends_in(path, ".ply")) {
    throw InputError(path, "is not a PLY file (it does not begin with 'ply')",
                     "export the file again");
  } else if (ends_in(path, ".obj") || looks_like_obj(content)) {
    mesh = parse_obj(content, path, origin, how);
  } else {
    throw InputError(path, "is neither PLY, OBJ nor glTF", "convert it to one of them");
  }
  check_mesh(mesh, path);
  return mesh;
}

void write_ply(const std::string& path, const Mesh& mesh) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "PLY is written as it lies in memory");
  std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                    std::to_string(mesh.vertices.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!mesh.faces.empty())
    out += "element face " + std::to_string(mesh.faces.size()) +
           "\nproperty list uchar int vertex_indices\n";
  out += "end_header\n";
  for (const Point& p : mesh.vertices)
    out.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
  for (const Triangle& face : mesh.faces) {
    add_bytes(out, uint8_t{3});
    add_bytes(out, face);
  }
  write_file_atomically(path, out);
}

void write_obj(const std::string& path, const Mesh& mesh) {
  std::string out;
  char line[128];
  for (const Point& p : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", static_cast<double>(p[0]),
                  static_cast<double>(p[1]), static_cast<double>(p[2]));
    out += line;
  }
  for (const Triangle& f : mesh.faces) {
    std::snprintf(line, sizeof line, "f %lld %lld %lld\n", f[0] + 1LL, f[1] + 1LL, f[2] + 1LL);
    out += line;
  }
  write_file_atomically(path, out);
}

}  // namespace restage
