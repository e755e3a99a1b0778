// Triangle meshes and clouds in PLY, OBJ, PCD and glTF files, in tables of points and raw numbers.
// Reading never trusts a count in a file. InputError "file[:line]: what; fix" for anything wrong:
// cut short, impossible counts, NaN or infinite coordinates, no points, a face index out of range,
// coordinates so far from the origin that single precision blurs them.
#pragma once

#include <string>

#include "datasets/readers/clouds/non_finite.h"

namespace restage {

/// What was left out of a frame.
struct LeftOut {
  size_t non_finite = 0;  ///< points that are NaN or infinite
  size_t faint = 0;       ///< splats that nobody sees (mesh_parsers.h)
};

/// PLY (ASCII, binary of both byte orders), OBJ, PCD, tables of points (mesh_parsers.h) or glTF
/// (.glb, .gltf, .vrm: all meshes of the scene as they rest, datasets/readers/gltf/gltf.h), told
/// apart by content, then by extension. Polygons become fans of triangles; normals, colours,
/// texture coordinates and groups are ignored; a file without faces is a cloud. Coordinates are
/// kept as they are (metres by convention).
Mesh read_mesh(const std::string& path);
/// The same of a frame: points that are NaN or infinite are left out, and `left_out` says how many;
/// it may be that none is left.
Mesh read_frame_mesh(const std::string& path, size_t& left_out);
/// The same without splats that nobody sees. `origin` is taken off all coordinates before they
/// become floats.
Mesh read_frame_mesh(const std::string& path, LeftOut& left_out, const Vec3& origin = Vec3::Zero());
/// The same of coordinates however far from the origin: where single precision would blur them
/// (precision.h), `origin` is taken off them first, else it is zero. InputError: no points.
Mesh read_mesh(const std::string& path, LeftOut& left_out, Vec3& origin);
/// From memory; it may have no points. `faint`: gets the number of splats that nobody sees, which
/// then are left out; may be null.
Mesh parse_mesh(const std::string& content, const std::string& path,
                const Vec3& origin = Vec3::Zero(), NonFinite how = NonFinite::refuse,
                size_t* faint = nullptr);

/// Binary little-endian PLY, float32: keeps every bit. Atomic; WorkError on a full disk.
void write_ply(const std::string& path, const Mesh& mesh);
/// OBJ text with nine digits: keeps every bit. Atomic.
void write_obj(const std::string& path, const Mesh& mesh);

/// Whether the name ends in .ply, .obj, .glb, .gltf or .vrm, in any case.
bool is_mesh_name(const std::string& path);
/// Whether it ends in .pcd, .xyz, .xyzn, .xyzrgb, .pts or .asc.
bool is_cloud_name(const std::string& path);
/// Whether it ends in .txt, .csv or .bin: a cloud, or something else altogether.
bool may_be_cloud_name(const std::string& path);
/// Whether a file of such a name is a cloud, by its first lines or numbers. InputError: cannot be
/// read.
bool is_cloud_by_content(const std::string& path);

}  // namespace restage
