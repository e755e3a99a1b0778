// Plain data of surfaces, bodies and motions, shared by data sources, training and inference.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/geometry/joint_definition.h"
#include "nn/geometry/skeleton.h"

namespace restage {

using Point = Eigen::Vector3f;
using Points = std::vector<Point>;  ///< metres
using Triangle = std::array<int32_t, 3>;

/// How much each joint moves each vertex: one row of 22 a vertex, whose sum is 1.
using SkinWeights = Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor>;

/// A triangle surface, or a cloud when `faces` is empty.
struct Mesh {
  Points vertices;
  std::vector<Triangle> faces;
};

/// How a surface changes with a pose before it is skinned: SMPL's pose blend shapes (Loper et al.,
/// SMPL, 2015, eq. 9), the same for everybody of a model.
struct PoseBlendShapes {
  static constexpr int kFeatures = 9 * (kJoints - 1);
  /// Row 3 v + axis: metres by which that coordinate of vertex v moves for each number of the local
  /// rotations of joints 1 to 21, row by row, less the identity's.
  Eigen::Matrix<float, Eigen::Dynamic, kFeatures, Eigen::RowMajor> directions;
};

/// One person or character in T-pose: lowest point at y = 0, facing +z, left = +x.
struct Body {
  std::string id;
  std::string split;  ///< "train", "validation" or "test"
  Mesh rest;
  Joints joints;  ///< rest joints, same frame as `rest`
  SkinWeights weights;
  JointDefinition definition = {};                      ///< which points of the body `joints` are
  std::shared_ptr<const PoseBlendShapes> blend_shapes;  ///< null: pose_surface() has its own rule
};

/// A motion as parameters, at kFps. Rotations are relative to `rest` (a T-like pose whose limbs may
/// point a little elsewhere than a body's: pose_on() corrects for that).
struct Motion {
  std::string id, subject, split, action;
  Joints rest;  ///< 22 joints of the source skeleton, zero rotations
  std::vector<std::array<Eigen::Quaternionf, kJoints>> global;  ///< world rotations per frame
  std::vector<Point> hips;  ///< midpoint of both hips over the floor, per frame
  size_t frames() const { return global.size(); }
};

/// The motion performed by a body (ground truth of retargeting): same world rotations, the limbs'
/// rest directions corrected by shortest arcs, trajectory scaled by leg length. One pose per frame.
Pose pose_on(const Motion& motion, const Body& body, size_t frame);

/// Surface of a posed body: with blend shapes as SMPL does it (they, then linear blend skinning),
/// else by dual-quaternion skinning plus muscle bulges. Neither can be reproduced by linear blend
/// skinning alone (docs/method.md). `pick` poses only these vertices (null: all).
Points pose_surface(const Body& body, const Pose& pose, const std::vector<int32_t>* pick = nullptr);

/// Plain linear blend skinning (spec 5.2) of all vertices, without blend shapes.
Points linear_blend_skinning(const Body& body, const Pose& pose);

}  // namespace restage
