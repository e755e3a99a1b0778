// What the files of motion capture (BVH, ASF) have in common, in the file's own units and axes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

struct SourceSkeleton {
  std::vector<std::string> names;
  std::vector<int> parents;   ///< a parent comes before its children; -1: root
  std::vector<Vec3> offsets;  ///< from the parent, zero pose
  std::vector<Vec3> ends;     ///< end site, from the joint; zero if it has none
  std::vector<uint8_t> has_end;
  size_t size() const { return names.size(); }
  /// A joint without an end site.
  void add(const std::string& name, int parent, const Vec3& offset) {
    names.push_back(name);
    parents.push_back(parent);
    offsets.push_back(offset);
    ends.push_back(Vec3::Zero());
    has_end.push_back(0);
  }
};

enum class Channel { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };

inline bool is_rotation(Channel channel) { return channel >= Channel::x_rotation; }
/// x, y or z: 0, 1 or 2.
inline int axis_of(Channel channel) { return static_cast<int>(channel) % 3; }
/// Rotation by `degrees` about the axis of a rotation channel.
inline Quat channel_rotation(Channel channel, double degrees) {
  return Quat(Eigen::AngleAxisd(degrees * (M_PI / 180.0), Vec3::Unit(axis_of(channel))));
}

}  // namespace restage
