// Meshes and clouds from memory; used by read_mesh(). `content` is the whole file, `path` only
// names it in errors. `origin` is taken off every vertex before it becomes a float.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "datasets/readers/clouds/non_finite.h"

namespace restage {

/// Faces of one or two corners (points and lines) make no triangles.
Mesh parse_obj(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);
/// `colours`: gets the vertices' red, green, blue and alpha, 0 to 1 as the file has them (sRGB), if
/// it has any; may be null.
Mesh parse_ply(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse,
               std::vector<std::array<float, 4>>* colours = nullptr);

/// PCD of the Point Cloud Library: ascii, binary and binary_compressed; of the fields x, y and z
/// count, as numbers of any kind. The sensor's place (VIEWPOINT) changes nothing.
Mesh parse_pcd(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);

/// Tables of numbers, a point a line (.xyz, .xyzrgb, .xyzn, .pts, .asc, .txt, .csv): x, y and z are
/// the first three columns, or those that a first line names so. Blanks, commas or semicolons stand
/// between numbers (beside semicolons decimals may have commas); lines with # or // say nothing; a
/// first line of one number is the count, as .pts files have it. Behind the count .xyz files may
/// have a line of any words; then, and where words stand in it, a fourth column in front of x, y
/// and z holds labels (elements). A .pts file may begin with "version: 1", "n_points: 68" and a
/// brace. Empty cells, NULL, NA, N/A, -- and their like are missing numbers, which count as NaN.
/// InputError: lines of unequal length, a table of many frames, a first column that counts.
Mesh parse_table(std::string_view content, const std::string& path,
                 const Vec3& origin = Vec3::Zero(), NonFinite how = NonFinite::refuse);

/// Whether the first bytes are those of a PCD file.
bool starts_as_pcd(std::string_view content);
/// Whether the first lines of a text are a table of points.
bool starts_as_table(std::string_view content);

}  // namespace restage
