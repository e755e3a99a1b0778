// FBX (Mixamo, Maya, 3ds Max, Blender), read as the GLB document that is made of it. Everything
// else in this project sees that document only (datasets/readers/gltf/gltf.h).
//
// Assimp reads the FBX (datasets/readers/assimp/); a program that was built without it refuses FBX.
// Assimp trusts the numbers in a file, so it works in a process of its own, with bounds on memory
// and time: a file that makes it crash is refused as any broken file is.
//
// What the document holds: the nodes with their names and hierarchy, pivots and offsets multiplied
// into them; meshes with all weights (most programs use the first four of a vertex, which are the
// largest), texture coordinates, colours, normals, morph targets with their names; materials
// (colour, opacity, pictures for colour, normals and glow; pictures in the file or in its folder
// are put into the document); animations of nodes and morph targets, straight between their keys.
// The root node turns the file's axes to y up and its units to metres. Cameras and lights become
// bare nodes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace restage {

/// Whether the name ends in .fbx, in any case.
bool is_fbx_name(const std::string& path);
/// Whether the content is FBX, as text or binary.
bool starts_as_fbx(std::string_view content);

/// The document, and what was left out (said in `remarks`). Pictures are looked for in the folder
/// of `path`. InputError for what is no usable FBX, or where this program has no Assimp.
std::string fbx_as_glb(std::string_view content, const std::string& path,
                       std::vector<std::string>* remarks);

}  // namespace restage
