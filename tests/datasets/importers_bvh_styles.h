// What the families of BVH files have in common: names of their bones, and LAFAN1's rest pose.
#pragma once

#include "datasets/importers/profiles.h"
#include "tests/datasets/importers_bvh_text.h"

namespace restage::bvh_test {

/// Names of a profile, as a file of the family has them.
inline std::vector<std::string> names_of(const std::string& profile,
                                         const std::string& prefix = "") {
  std::vector<std::string> out;
  const Profile found = find_profile(profile);
  for (const auto& bones : found.bones) out.push_back(bones.empty() ? "none" : prefix + bones[0]);
  return out;
}

/// Every bone along +x at zero rotations, twisted as LAFAN1's are.
inline Rotations bones_along_x() {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const auto frame = [](const Vec3& bone, const Vec3& second) {
    Mat3 m;
    m << bone, second, bone.cross(second);
    return m;
  };
  Rotations out;
  out.fill(frame(y, z));  // the trunk: up, front, left
  for (const int j : {1, 2, 4, 5}) out[j] = frame(-y, z);
  for (const int j : {13, 16, 18, 20}) out[j] = frame(x, -z);
  for (const int j : {14, 17, 19, 21}) out[j] = frame(-x, -z);
  for (const int j : {7, 8, 10, 11}) {
    const Vec3 foot = (rest()[10] - rest()[7]).normalized();
    const Vec3 level(0, foot.y(), std::sqrt(1 - foot.y() * foot.y()));
    out[j] = frame(level, Vec3(0, level.z(), -level.y()));
  }
  return out;
}

}  // namespace restage::bvh_test
