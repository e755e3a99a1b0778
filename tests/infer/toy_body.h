// A body of capsules, one per bone, for the tests of writers and pictures: no data needed.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/tiny_body.h"

namespace restage::testing {

// Rings of `around` points along the bone, closed by its end points.
inline void add_capsule(Mesh& mesh, const Vec3& a, const Vec3& b, double radius, int along,
                        int around) {
  const Vec3 axis = (b - a).normalized();
  const Vec3 u = axis.unitOrthogonal(), w = axis.cross(u);
  const auto base = static_cast<int32_t>(mesh.vertices.size());
  for (int r = 0; r < along; ++r) {
    const double t = static_cast<double>(r) / (along - 1), s = 2 * t - 1;
    const double width = radius * std::sqrt(std::max(.15, 1 - s * s * s * s));
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      const Vec3 p = a + t * (b - a) + width * (std::cos(angle) * u + std::sin(angle) * w);
      mesh.vertices.push_back(p.cast<float>());
    }
  }
  const int32_t start = base + along * around, end = start + 1;
  mesh.vertices.push_back((a - .6 * radius * axis).cast<float>());
  mesh.vertices.push_back((b + .6 * radius * axis).cast<float>());
  for (int32_t k = 0; k < around; ++k) {
    const int32_t n = (k + 1) % around;
    for (int32_t r = 0; r + 1 < along; ++r) {
      const int32_t i = base + r * around;
      mesh.faces.push_back({i + k, i + n, i + around + n});
      mesh.faces.push_back({i + k, i + around + n, i + around + k});
    }
    mesh.faces.push_back({start, base + n, base + k});
    mesh.faces.push_back({end, start - around + k, start - around + n});
  }
}

/// `weights` of all 22 joints are positive and fall with the distance, like those of a network.
inline Body toy_body(int along = 8, int around = 12) {
  Body body;
  body.id = "toy";
  body.joints = tiny_joints();
  for (int j = 1; j < kJoints; ++j) {
    const double radius = j == 3 || j == 6 || j == 9 ? .14 : j == 15 ? .1 : j < 6 ? .08 : .05;
    add_capsule(body.rest, body.joints[kParents[j]], body.joints[j], radius, along, around);
  }
  float floor = 1e9f;
  for (const Point& p : body.rest.vertices) floor = std::min(floor, p.y());
  for (Point& p : body.rest.vertices) p.y() -= floor;
  for (Vec3& p : body.joints) p.y() -= double{floor};
  body.weights.resize(static_cast<Eigen::Index>(body.rest.vertices.size()), kJoints);
  for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
    Eigen::Matrix<double, 1, kJoints> row;
    for (int j = 0; j < kJoints; ++j)
      row[j] = std::pow(.03 + (body.rest.vertices[v].cast<double>() - body.joints[j]).norm(), -4);
    body.weights.row(static_cast<Eigen::Index>(v)) = (row / row.sum()).cast<float>();
  }
  return body;
}

/// A walk-like pose; `phase` in turns.
inline Pose toy_pose(const Body& body, double phase) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  const double s = std::sin(2 * std::numbers::pi * phase);
  const auto turn = [](double angle, const Vec3& axis) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  pose.local[0] = turn(.5 * s + 7 * phase, y);
  pose.local[1] = turn(-.6 * s, x), pose.local[2] = turn(.6 * s, x);
  pose.local[4] = turn(.5 + .4 * s, x), pose.local[5] = turn(.5 - .4 * s, x);
  pose.local[16] = turn(-1.2, z) * turn(.4 * s, y), pose.local[17] = turn(1.2, z) * turn(.4 * s, y);
  pose.local[18] = turn(-.7, y), pose.local[19] = turn(.7, y);
  pose.root = body.joints[0] + Vec3(.3 * s, -.05, phase);
  return pose;
}

}  // namespace restage::testing
