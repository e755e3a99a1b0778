// A T-pose as something that can be fitted to clouds: nodes spread evenly over it, each carried by
// a few of the 22 joints. Weights come from distances to bones; nothing is learned.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

using SkinWeights = Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor>;

/// Skinning weights of points at rest: the four nearest bones in proportion to distance^-4, where a
/// joint's bones run to its children (hands, toes and head: as far again as from their parent).
SkinWeights bone_distance_weights(const Points& points, const Joints& rest);

struct RigNode {
  Vec3 rest;                      ///< metres, in the T-pose
  Vec3 normal;                    ///< zero where the target has no faces
  std::array<int, 4> joint;       ///< who carries it,
  std::array<double, 4> weight;   ///< by how much; sums to 1
  std::array<int, 8> neighbours;  ///< the nearest other nodes of the T-pose
};

struct Rig {
  Joints joints;
  std::vector<RigNode> nodes;
};

inline constexpr size_t kRigNodes = 600;  ///< about 5 cm apart on a person
inline constexpr size_t kLeastRigPoints = 64;

/// The first `count` points of farthest point sampling (ties to the lower index), with weights as
/// above. InputError naming `where`: fewer than kLeastRigPoints distinct points, points or joints
/// that are not finite.
Rig make_rig(const Mesh& target, const Joints& rest, const std::string& where,
             size_t count = kRigNodes);

}  // namespace restage
