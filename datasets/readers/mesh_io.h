// Triangle meshes and clouds in PLY, OBJ and glTF files.
// Reading never trusts a count in a file. InputError "file[:line]: what; fix" for anything wrong:
// cut short, impossible counts, NaN or infinite coordinates, no points, a face index out of range,
// coordinates so far from the origin that single precision blurs them.
#pragma once

#include <string>

#include "datasets/readers/non_finite.h"

namespace restage {

/// PLY (ASCII, binary of both byte orders), OBJ or glTF (.glb, .gltf, .vrm: all meshes of the scene
/// as they rest, datasets/readers/gltf.h), told apart by content, then by extension. Polygons
/// become fans of triangles; normals, colours, texture coordinates and groups are ignored; a file
/// without faces is a cloud. Coordinates are kept as they are (metres by convention).
Mesh read_mesh(const std::string& path);
/// The same without points of a PLY or OBJ file that are NaN or infinite, and how many these are.
Mesh read_mesh(const std::string& path, size_t& left_out);
/// The same of coordinates however far from the origin: where single precision would blur them
/// (precision.h), `origin` is taken off them first, else it is zero.
Mesh read_mesh(const std::string& path, size_t& left_out, Vec3& origin);
/// From memory.
Mesh parse_mesh(const std::string& content, const std::string& path,
                const Vec3& origin = Vec3::Zero(), NonFinite how = NonFinite::refuse);

/// Binary little-endian PLY, float32: keeps every bit. Atomic; WorkError on a full disk.
void write_ply(const std::string& path, const Mesh& mesh);
/// OBJ text with nine digits: keeps every bit. Atomic.
void write_obj(const std::string& path, const Mesh& mesh);

/// Whether the name ends in .ply, .obj, .glb, .gltf or .vrm, in any case.
bool is_mesh_name(const std::string& path);

}  // namespace restage
