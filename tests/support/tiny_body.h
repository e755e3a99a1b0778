// A body of boxes, a motion and a corpus that cost nothing to make: fixtures for tests of whatever
// works on bodies and motions.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "datasets/corpus.h"

namespace restage::testing {

/// Rest joints of a person of about 1.7 `size` metres; `width` stretches x only.
inline Joints tiny_joints(double size = 1.0, double width = 1.0) {
  Joints out = {
      Vec3(0, .95, 0),       Vec3(.09, .88, 0),      Vec3(-.09, .88, 0),    Vec3(0, 1.06, 0),
      Vec3(.1, .48, .01),    Vec3(-.1, .48, .01),    Vec3(0, 1.2, 0),       Vec3(.1, .08, -.02),
      Vec3(-.1, .08, -.02),  Vec3(0, 1.27, .02),     Vec3(.11, .02, .1),    Vec3(-.11, .02, .1),
      Vec3(0, 1.47, -.02),   Vec3(.07, 1.39, 0),     Vec3(-.07, 1.39, 0),   Vec3(0, 1.56, .03),
      Vec3(.18, 1.41, -.01), Vec3(-.18, 1.41, -.01), Vec3(.44, 1.41, -.02), Vec3(-.44, 1.41, -.02),
      Vec3(.7, 1.41, 0),     Vec3(-.7, 1.41, 0)};
  for (Vec3& x : out) x = size * Vec3(width * x.x(), x.y(), x.z());
  return out;
}

/// A box about every bone. Its far end shares its weights with the bone's far joint.
inline Body tiny_body(const std::string& id, const std::string& split, double size = 1.0,
                      double width = 1.0) {
  Body body;
  body.id = id;
  body.split = split;
  body.joints = tiny_joints(size, width);
  body.weights.setZero(8 * (kJoints - 1), kJoints);
  static constexpr int quads[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                      {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  for (int j = 1; j < kJoints; ++j) {
    const Vec3 from = body.joints[kParents[j]], to = body.joints[j];
    const Vec3 u = (to - from).unitOrthogonal(), v = (to - from).cross(u).normalized();
    const int first = static_cast<int>(body.rest.vertices.size());
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 x =
          (corner & 4 ? to : from) + 0.04 * size * ((corner & 1 ? u : -u) + (corner & 2 ? v : -v));
      const float far = corner & 4 ? 0.4f : 0.0f;
      body.rest.vertices.push_back(x.cast<float>());
      body.weights(first + corner, kParents[j]) = 1.0f - far;
      body.weights(first + corner, j) = far;
    }
    for (const auto& q : quads) {
      body.rest.faces.push_back({first + q[0], first + q[1], first + q[2]});
      body.rest.faces.push_back({first + q[0], first + q[2], first + q[3]});
    }
  }
  return body;
}

/// Every joint swings about its own axis, left and right differently, on a curved path.
inline Motion tiny_motion(const std::string& id, const std::string& subject,
                          const std::string& split, size_t frames, double phase = 0.0) {
  Motion motion;
  motion.id = id;
  motion.subject = subject;
  motion.split = split;
  motion.action = "swing";
  motion.rest = tiny_joints();
  motion.rest[4].x() += 0.08;  // legs a little apart, so that pose_on() has directions to correct
  for (size_t f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / kFps;
    Rotations local;
    for (int j = 0; j < kJoints; ++j) {
      const Vec3 axis(std::sin(1.0 + j), std::cos(2.0 * j), 0.5 * std::sin(3.0 * j + 1.0));
      const double angle = (j == 0 ? 0.5 : 0.35) * std::sin(2.0 * t + 0.7 * j + phase);
      local[j] = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    }
    const Rotations global = to_global(local);
    motion.global.emplace_back();
    for (int j = 0; j < kJoints; ++j) motion.global.back()[j] = Quat(global[j]).cast<float>();
    motion.hips.push_back(
        Vec3(std::sin(t + phase), 0.86 + 0.02 * std::sin(5 * t), 1.2 * t).cast<float>());
  }
  return motion;
}

/// Where a motion has its skeleton's joints in a frame.
inline Joints motion_joints(const Motion& motion, size_t frame) {
  Pose pose;
  Rotations global;
  for (size_t j = 0; j < kJoints; ++j)
    global[j] = motion.global[frame][j].cast<double>().toRotationMatrix();
  pose.local = to_local(global);
  Joints out = forward_kinematics(motion.rest, pose).joints;
  const Vec3 move = motion.hips[frame].cast<double>() - 0.5 * (out[1] + out[2]);
  for (Vec3& x : out) x += move;
  return out;
}

/// 3 + 2 + 2 bodies and 3 + 2 + 2 motions (one of them of ten frames only).
inline Corpus tiny_corpus() {
  Corpus out;
  const char* splits[] = {"train", "validation", "test"};
  for (int s = 0; s < 3; ++s)
    for (int i = 0; i < (s == 0 ? 3 : 2); ++i) {
      const std::string name = std::string(splits[s]) + std::to_string(i);
      out.bodies.push_back(
          tiny_body("body_" + name, splits[s], 0.9 + 0.1 * s + 0.05 * i, 1.0 + 0.1 * i));
      const size_t frames = i == 1 ? 10 : static_cast<size_t>(50 + 7 * s + i);
      out.motions.push_back(
          tiny_motion("motion_" + name, "subject_" + name, splits[s], frames, s + 0.3 * i));
    }
  out.description = "boxes";
  out.license = "Apache-2.0";
  return out;
}

}  // namespace restage::testing
