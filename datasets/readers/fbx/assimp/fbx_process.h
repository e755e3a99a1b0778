// The reading of FBX in a process of its own (datasets/readers/fbx/fbx.h says why).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace restage {

/// fbx_to_glb() in a child process that may take some memory and some seconds. InputError as there,
/// and where the child crashes or goes beyond its bounds.
std::string fbx_in_a_process(std::string_view content, const std::string& path,
                             std::vector<std::string>* remarks);

}  // namespace restage
