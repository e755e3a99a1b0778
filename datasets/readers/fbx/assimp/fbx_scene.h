// From the bytes of an FBX file to the GLB document that datasets/readers/fbx/fbx.h describes.
// Assimp may crash on hostile bytes: datasets/readers/fbx/assimp/fbx_process.h calls this.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace restage {

/// Assimp's words as a part of a line: printable, not too long, without the place in its own
/// tokens.
std::string assimp_words(std::string_view words);

/// InputError where the scene cannot be kept: skins on bones that are not there or not unique, NaN,
/// axes that are none. Any std::exception where Assimp refuses the file.
std::string fbx_to_glb(std::string_view content, const std::string& path,
                       std::vector<std::string>* remarks);

}  // namespace restage
