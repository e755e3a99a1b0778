// A target in T-pose, made ready to be fitted to clouds: nodes are spread evenly over the target,
// and a few of the 22 joints carry each node. Weights come from distances to bones; nothing is
// learned.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Skinning weights of points at rest: of each point, the four nearest bones in proportion to
/// distance^-4. The bones of a joint run from the joint to its children. Hands, toes and head have
/// no children: their bone goes on beyond the joint, as long as the bone before it.
SkinWeights bone_distance_weights(const Points& points, const Joints& rest);

struct RigNode {
  Vec3 rest;                      ///< metres, in the T-pose
  Vec3 normal;                    ///< zero where the target has no faces
  std::array<int, 4> joint;       ///< the joints that carry the node
  std::array<double, 4> weight;   ///< the share of each of these joints; the four sum to 1
  std::array<int, 8> neighbours;  ///< the other nodes that are nearest in the T-pose
};

struct Rig {
  Joints joints;
  std::vector<RigNode> nodes;
};

inline constexpr size_t kRigNodes = 600;  ///< about 5 cm apart on a person
inline constexpr size_t kLeastRigPoints = 64;

/// The rig of a target. Nodes are the first `count` points of farthest point sampling (of points
/// that are equally far, the one with the lower number); weights are bone_distance_weights().
/// InputError naming `where`: fewer than kLeastRigPoints distinct points, points or joints that are
/// not finite.
Rig make_rig(const Mesh& target, const Joints& rest, const std::string& where,
             size_t count = kRigNodes);

}  // namespace restage
