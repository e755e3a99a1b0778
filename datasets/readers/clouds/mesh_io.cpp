#include "datasets/readers/clouds/mesh_io.h"

#include <algorithm>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/precision.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/gltf/gltf.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/mesh_file.h"

namespace restage {
namespace {

bool starts_as_ply(const std::string& content) {
  if (!content.starts_with("ply")) return false;
  const size_t end = content.find_first_not_of(" \t\r", 3);
  return end != std::string::npos && content[end] == '\n';
}

/// A line "v ..." near the start, and no binary zeros.
bool looks_like_obj(const std::string& content) {
  const std::string head = "\n" + content.substr(0, 65536);
  return head.find('\0') == std::string::npos && head.find("\nv ") != std::string::npos;
}

void check_faces(const Mesh& mesh, const std::string& path) {
  for (size_t i = 0; i < mesh.faces.size(); ++i)
    for (const int32_t index : mesh.faces[i])
      if (index < 0 || static_cast<size_t>(index) >= mesh.vertices.size())
        throw InputError(path,
                         cat("triangle ", i, " has vertex index ", index,
                             " (from 0), out of range for ", mesh.vertices.size(), " vertices"),
                         "correct the face list");
}

void require_points(const Mesh& mesh, const std::string& path) {
  if (mesh.vertices.empty())
    throw InputError(path, "holds no points", "give a mesh or cloud that has some");
}

Mesh without_non_finite(const std::string& content, const std::string& path, const Vec3& origin,
                        LeftOut& left_out) {
  Mesh mesh = parse_mesh(content, path, origin, NonFinite::mark, &left_out.faint);
  left_out.non_finite = leave_out_non_finite(mesh.vertices, mesh.faces);
  return mesh;
}

/// InputError if nothing is left of it.
void require_some(const Mesh& mesh, size_t left_out, const std::string& path) {
  if (left_out == 0) require_points(mesh, path);
  if (mesh.vertices.empty())
    throw InputError(path, "holds no points but NaN and infinite ones", "export it again");
}

}  // namespace

bool is_mesh_name(const std::string& path) {
  return text::ends_in(path, {".ply", ".obj"}) || is_gltf_name(path);
}

bool is_cloud_name(const std::string& path) {
  return text::ends_in(path, {".pcd", ".xyz", ".xyzn", ".xyzrgb", ".pts", ".asc"});
}

bool may_be_cloud_name(const std::string& path) {
  return text::ends_in(path, {".txt", ".csv", ".bin"});
}

bool is_cloud_by_content(const std::string& path) {
  FileStream file(path);
  if (text::ends_in(path, {".bin"})) {
    const std::vector<char> head = file.take(std::min<uint64_t>(file.size(), kRawHead));
    return raw_columns({head.data(), head.size()}, file.size()) > 0;
  }
  const std::vector<char> head = file.take(std::min<uint64_t>(file.size(), 5000));
  return starts_as_table({head.data(), head.size()});
}

Mesh read_mesh(const std::string& path) {
  Mesh mesh = parse_mesh(read_file(path), path);
  require_points(mesh, path);
  check_precision(mesh.vertices, path, kDoctorMoves);
  return mesh;
}

Mesh read_frame_mesh(const std::string& path, size_t& left_out) {
  left_out = 0;
  const std::string content = read_file(path);
  if (content.empty()) return {};  // a recorder that saw nothing
  Mesh mesh = parse_mesh(content, path, Vec3::Zero(), NonFinite::mark);
  left_out = leave_out_non_finite(mesh.vertices, mesh.faces);
  check_precision(mesh.vertices, path, kDoctorMoves);
  return mesh;
}

Mesh read_frame_mesh(const std::string& path, LeftOut& left_out, const Vec3& origin) {
  left_out = {};
  const std::string content = read_file(path);
  return content.empty() ? Mesh() : without_non_finite(content, path, origin, left_out);
}

Mesh read_mesh(const std::string& path, LeftOut& left_out, Vec3& origin) {
  const std::string content = read_file(path);
  origin.setZero();
  Mesh mesh = without_non_finite(content, path, origin, left_out);
  require_some(mesh, left_out.non_finite, path);
  if (is_gltf_name(path) || !is_blurred(mesh.vertices)) return mesh;  // glTF is single precision
  origin = mesh.vertices[0].cast<double>();
  return without_non_finite(content, path, origin, left_out);
}

Mesh parse_mesh(const std::string& content, const std::string& path, const Vec3& origin,
                NonFinite how, size_t* faint) {
  refuse_foreign_content(content, path);
  Mesh mesh;
  if (content.empty() && !is_cloud_name(path) && !may_be_cloud_name(path)) {
    throw InputError(path, "is empty and holds no points", "give a mesh or cloud that has some");
  } else if (is_gltf_name(path) || content.compare(0, 4, "glTF") == 0) {
    const Gltf file = parse_gltf(content, path);
    mesh = gltf_mesh(file, gltf_rest(file));
    for (Point& p : mesh.vertices) p -= origin.cast<float>();
    return mesh;
  } else if (starts_as_ply(content)) {
    mesh = parse_ply(content, path, origin, how, nullptr, faint);
  } else if (text::ends_in(path, {".ply"})) {
    throw InputError(path, "is not a PLY file (it does not begin with 'ply')",
                     "export the file again");
  } else if (text::ends_in(path, {".obj"}) || looks_like_obj(content)) {
    mesh = parse_obj(content, path, origin, how);
  } else if (text::ends_in(path, {".pcd"}) || starts_as_pcd(content)) {
    mesh = parse_pcd(content, path, origin, how);
  } else if (text::ends_in(path, {".bin"})) {
    mesh = parse_raw(content, path, origin, how);
  } else if (is_cloud_name(path) || may_be_cloud_name(path)) {
    mesh = parse_table(content, path, origin, how);
  } else {
    refuse_foreign_kind(path);
    throw InputError(path, "is neither PLY, OBJ, glTF nor a cloud (PCD, XYZ)",
                     "convert it to one of them");
  }
  check_faces(mesh, path);
  return mesh;
}

void write_ply(const std::string& path, const Mesh& mesh) {
  write_file_atomically(path, ply_bytes(mesh.vertices, mesh.faces, false));
}

void write_obj(const std::string& path, const Mesh& mesh) {
  write_file_atomically(path, obj_bytes(mesh.vertices, mesh.faces, false));
}

}  // namespace restage
