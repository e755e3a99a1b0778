// PLY from memory; used by read_mesh().
#pragma once

#include <string>
#include <string_view>

#include "nn/geometry/body.h"

namespace restage {

/// `content` is the whole file, `path` only names it in errors.
Mesh parse_ply(std::string_view content, const std::string& path);

}  // namespace restage
