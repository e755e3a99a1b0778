// Meshes and clouds from memory; used by read_mesh(). `content` is the whole file, `path` only
// names it in errors. `origin` is taken off every vertex before it becomes a float.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "datasets/readers/clouds/non_finite.h"

namespace restage {

/// Faces of one or two corners (points and lines) make no triangles.
Mesh parse_obj(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);
/// Of splats (Gaussians), also SuperSplat's compressed ones (packed_position), the centres are
/// read. `colours`: gets the vertices' red, green, blue and alpha, 0 to 1 as the file has them
/// (sRGB), if it has any; may be null. `faint`: gets the number of splats of an opacity below a
/// tenth, which then are left out, unless fewer than 64 others are there; may be null.
Mesh parse_ply(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse,
               std::vector<std::array<float, 4>>* colours = nullptr, size_t* faint = nullptr);

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
/// A first column of whole numbers that rise, before three of decimals, numbers the points and is
/// left out; so is what a first line calls a list ("TRACK[]", COLMAP's points3D.txt).
/// InputError: lines of unequal length, a table of many frames, a first column that counts.
Mesh parse_table(std::string_view content, const std::string& path,
                 const Vec3& origin = Vec3::Zero(), NonFinite how = NonFinite::refuse);

/// Points of a LiDAR as bare numbers (.bin of KITTI and nuScenes): float32 x y z and intensity,
/// perhaps the ring, of each. InputError: the numbers are no such points.
Mesh parse_raw(std::string_view content, const std::string& path, const Vec3& origin = Vec3::Zero(),
               NonFinite how = NonFinite::refuse);
/// How many numbers each point has, 4 or 5, by a file's size and its first kRawHead bytes; 0: it
/// holds no points of a LiDAR.
size_t raw_columns(std::string_view head, uint64_t bytes);
inline constexpr uint64_t kRawHead = 80000;

/// Whether the first bytes are those of a PCD file.
bool starts_as_pcd(std::string_view content);
/// Whether the first lines of a text are a table of points.
bool starts_as_table(std::string_view content);

}  // namespace restage
