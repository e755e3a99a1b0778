// Bytes of single meshes and clouds: binary little-endian PLY and OBJ. Written here and not with
// the readers because inference and data sources do not see each other.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

enum class MeshFormat { ply, obj };

/// "ply" or "obj", without a dot.
const char* extension(MeshFormat format);
/// Binary PLY, float32 x y z in metres; faces as `list uchar int vertex_indices`, none for a cloud.
std::string ply_bytes(const Points& vertices, const std::vector<Triangle>& faces);
/// OBJ text, nine significant digits (float32 comes back exactly), 1-based faces.
std::string obj_bytes(const Points& vertices, const std::vector<Triangle>& faces);
std::string mesh_bytes(MeshFormat format, const Points& vertices,
                       const std::vector<Triangle>& faces);
/// InputError, naming `where`, when the mesh is empty, a coordinate is not finite, or a face names
/// a vertex that is not there. Every writer calls it first.
void check_mesh(const std::string& where, const Points& vertices,
                const std::vector<Triangle>& faces);

}  // namespace restage
