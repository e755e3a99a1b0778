// An OBJ or PLY file as a glTF document, so that a mesh without bones keeps how it looks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace restage {

struct MeshDocument {
  std::string glb;
  /// Of each vertex of the document, in the order of its primitives, the vertex of the file. An OBJ
  /// vertex whose faces have other texture coordinates or materials is there more than once.
  std::vector<int32_t> vertex;
  std::vector<std::string> remarks;  ///< on what could not be taken
};

/// Of an OBJ file: texture coordinates, normals, materials (colour, picture, glow, opacity) with
/// their names, vertex colours. Of a PLY file: vertex colours. Pictures are PNG or JPEG, beside the
/// file or below its folder, and go over byte by byte. Normals are made where there are none.
/// `vertices`: how many were read from the file. Nothing: it is of another kind, has no faces, or
/// nothing but its shape. `small`: normals, texture coordinates and indices are as short as
/// KHR_mesh_quantization allows.
std::optional<MeshDocument> mesh_document(const std::string& path, size_t vertices,
                                          bool small = false);

}  // namespace restage
