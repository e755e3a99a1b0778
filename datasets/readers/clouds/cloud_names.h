// What arrays are called that hold a cloud, and arrays that have its shape and hold something else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace restage {

/// How surely an array of this name is the cloud of its file (points, vertices, xyz ...; case does
/// not matter), 0 the surest; nothing for other names.
std::optional<size_t> cloud_rank(const std::string& name);

/// Whether an array of this name is no cloud, whatever its shape: normals, colours, joints, numbers
/// of a body model; of one that would be a single cloud (`one_frame`) also paths (root_pos, trans,
/// com) and what instruments measured (gyro), unless the name also speaks of points
/// (camera_points) or is numbered as a frame is (pose_0001).
bool is_no_cloud(const std::string& name, bool one_frame);

/// Whether an array of this name and shape holds depth pictures, [H, W] or [F, H, W].
bool are_depth_pictures(const std::string& name, const std::vector<int64_t>& shape);

}  // namespace restage
