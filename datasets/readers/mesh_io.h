// Triangle meshes and clouds in PLY, OBJ and glTF files.
// Reading never trusts a count in a file. InputError "file[:line]: what; fix" for anything wrong:
// cut short, impossible counts, NaN or infinite coordinates, no points, a face index out of range.
#pragma once

#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// PLY (ASCII, binary of both byte orders), OBJ or glTF (.glb, .gltf, .vrm: all meshes of the scene
/// as they rest, datasets/readers/gltf.h), told apart by content, then by extension. Polygons
/// become fans of triangles; normals, colours, texture coordinates and groups are ignored; a file
/// without faces is a cloud. Coordinates are kept as they are (metres by convention).
Mesh read_mesh(const std::string& path);
/// The same from memory.
Mesh parse_mesh(const std::string& content, const std::string& path);

/// Binary little-endian PLY, float32: keeps every bit. Atomic; WorkError on a full disk.
void write_ply(const std::string& path, const Mesh& mesh);
/// OBJ text with nine digits: keeps every bit. Atomic.
void write_obj(const std::string& path, const Mesh& mesh);

/// Whether the name ends in .ply, .obj, .glb, .gltf or .vrm, in any case.
bool is_mesh_name(const std::string& path);

}  // namespace restage
