// OBJ and PLY from memory; used by read_mesh(). `content` is the whole file, `path` only names it
// in errors. `origin` is taken off every vertex before it becomes a float.
#pragma once

#include <string>
#include <string_view>

#include "datasets/readers/non_finite.h"

namespace restage {

Mesh parse_obj(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);
Mesh parse_ply(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);

}  // namespace restage
