// Bytes of single meshes and clouds: binary little-endian PLY and OBJ. Both keep every bit of a
// float.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

enum class MeshFormat { ply, obj };

/// "ply" or "obj", without a dot.
const char* extension(MeshFormat format);
/// Binary PLY, float32 x y z; faces as `list uchar int vertex_indices`, none for a cloud.
/// `comment`: a line on who wrote it, in metres and y up.
std::string ply_bytes(const Points& vertices, const std::vector<Triangle>& faces,
                      bool comment = true);
/// OBJ text, nine significant digits, 1-based faces.
std::string obj_bytes(const Points& vertices, const std::vector<Triangle>& faces,
                      bool comment = true);
std::string mesh_bytes(MeshFormat format, const Points& vertices,
                       const std::vector<Triangle>& faces);
/// The line that says so.
std::string comment_of(MeshFormat format);
/// Whether a file of that format which begins with `head`, 80 bytes or more of it, has the comment
/// of the functions above.
bool is_ours(MeshFormat format, const std::string& head);
/// InputError, naming `where`, when the mesh is empty, a coordinate is not finite, or a face names
/// a vertex that is not there. Every writer calls it first.
void check_mesh(const std::string& where, const Points& vertices,
                const std::vector<Triangle>& faces);

}  // namespace restage
