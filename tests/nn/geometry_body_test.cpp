// Posing and skinning, against values of the data folder's reference tools (tests/golden).
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "autograd/base/error.h"
#include "nn/geometry/body.h"

namespace restage {
namespace {

using nlohmann::json;

const json& golden() {
  static const json value = [] {
    std::ifstream in(RESTAGE_SOURCE_DIR "/tests/golden/bodies.json");
    return json::parse(in);
  }();
  return value;
}

Vec3 vec3(const json& x) { return Vec3(x.at(0), x.at(1), x.at(2)); }

Joints joints_of(const json& x) {
  Joints out;
  for (int j = 0; j < kJoints; ++j) out[j] = vec3(x.at(j));
  return out;
}

/// Body 0 of the golden file: 200 of its vertices.
Body golden_body() {
  const json& b = golden().at("bodies").at(0);
  Body out;
  out.id = b.at("id");
  out.joints = joints_of(b.at("joints"));
  const size_t n = b.at("vertices").size();
  out.weights.setZero(static_cast<Eigen::Index>(n), kJoints);
  for (size_t i = 0; i < n; ++i) {
    out.rest.vertices.push_back(vec3(b.at("vertices").at(i)).cast<float>());
    for (const json& pair : b.at("weights").at(i))
      out.weights(static_cast<Eigen::Index>(i), pair.at(0).get<int>()) = pair.at(1);
  }
  return out;
}

Motion golden_motion(const json& pose) {
  Motion out;
  out.rest = joints_of(pose.at("rest"));
  out.global.resize(1);
  for (int j = 0; j < kJoints; ++j) {
    const json& q = pose.at("source").at(j);
    out.global[0][j] = Quat(q.at(3), q.at(0), q.at(1), q.at(2)).cast<float>();
  }
  out.hips.push_back(vec3(pose.at("hips")).cast<float>());
  return out;
}

Pose rest_pose(const Body& body) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = body.joints[0];
  return pose;
}

double distance(const Points& a, const Points& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    worst = std::max<double>(worst, (a[i] - b[i]).norm());
  return worst;
}

/// A tube along the left arm, radius 5 cm, weights blending over 12 cm about the elbow.
Body arm_tube() {
  Body body = golden_body();
  const Vec3 shoulder = body.joints[16], elbow = body.joints[18], wrist = body.joints[20];
  body.rest.vertices.clear();
  std::vector<float> lower;
  for (int ring = 0; ring <= 40; ++ring)
    for (int k = 0; k < 24; ++k) {
      const double x = shoulder.x() + (wrist.x() - shoulder.x()) * ring / 40.0;
      const double a = 2 * M_PI * k / 24;
      body.rest.vertices.push_back(
          Vec3(x, elbow.y() + 0.05 * std::cos(a), elbow.z() + 0.05 * std::sin(a)).cast<float>());
      lower.push_back(std::clamp(static_cast<float>((x - elbow.x()) / 0.12 + 0.5), 0.0f, 1.0f));
    }
  body.weights.setZero(static_cast<Eigen::Index>(lower.size()), kJoints);
  for (size_t i = 0; i < lower.size(); ++i) {
    body.weights(static_cast<Eigen::Index>(i), 18) = lower[i];
    body.weights(static_cast<Eigen::Index>(i), 16) = 1 - lower[i];
  }
  return body;
}

/// Enclosed volume of the tube, ends closed by fans.
double tube_volume(const Points& p) {
  const auto tet = [&](const Point& a, const Point& b, const Point& c) {
    return a.cast<double>().dot(b.cast<double>().cross(c.cast<double>())) / 6;
  };
  const auto at = [&](int ring, int k) { return p[static_cast<size_t>(ring * 24 + k % 24)]; };
  double sum = 0;
  for (int ring = 0; ring < 40; ++ring)
    for (int k = 0; k < 24; ++k)
      sum += tet(at(ring, k), at(ring, k + 1), at(ring + 1, k)) +
             tet(at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k));
  for (int k = 1; k < 23; ++k) {
    sum += tet(at(0, 0), at(0, k + 1), at(0, k));
    sum += tet(at(40, 0), at(40, k), at(40, k + 1));
  }
  return std::abs(sum);
}

TEST(GeometryBody, RestPoseGivesRestSurface) {
  const Body body = golden_body();
  EXPECT_LT(distance(pose_surface(body, rest_pose(body)), body.rest.vertices), 2e-6);
  EXPECT_LT(distance(linear_blend_skinning(body, rest_pose(body)), body.rest.vertices), 2e-6);
}

TEST(GeometryBody, RigidMotionIsExact) {
  const Body body = golden_body();
  Pose pose = rest_pose(body);
  const Mat3 turn = Eigen::AngleAxisd(2.5, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
  pose.local[0] = turn;
  pose.root = Vec3(3, -1, 2);
  Points expected;
  for (const Point& v : body.rest.vertices)
    expected.push_back((turn * (v.cast<double>() - body.joints[0]) + pose.root).cast<float>());
  EXPECT_LT(distance(pose_surface(body, pose), expected), 3e-6);
  EXPECT_LT(distance(linear_blend_skinning(body, pose), expected), 3e-6);
}

TEST(GeometryBody, PoseOnFollowsReferenceTool) {
  const Body body = golden_body();
  ASSERT_EQ(golden().at("poses").size(), 4u);
  for (const json& expected : golden().at("poses")) {
    const Pose pose = pose_on(golden_motion(expected), body, 0);
    EXPECT_LT((pose.root - vec3(expected.at("root"))).norm(), 2e-6);
    const PosedSkeleton posed = forward_kinematics(body.joints, pose);
    for (int j = 0; j < kJoints; ++j) {
      for (int k = 0; k < 9; ++k)
        EXPECT_NEAR(posed.global[j](k / 3, k % 3), expected.at("world").at(j).at(k).get<double>(),
                    1e-6);
      EXPECT_LT((posed.joints[j] - vec3(expected.at("joints").at(j))).norm(), 5e-6);
    }
  }
}

TEST(GeometryBody, LinearBlendSkinningFollowsReferenceTool) {
  const Body body = golden_body();
  for (const json& expected : golden().at("poses")) {
    const Points skin = linear_blend_skinning(body, pose_on(golden_motion(expected), body, 0));
    for (size_t i = 0; i < expected.at("surface").size(); ++i)  // every fourth vertex
      EXPECT_LT((skin[4 * i].cast<double>() - vec3(expected.at("surface").at(i))).norm(), 5e-6);
  }
}

TEST(GeometryBody, PickedVerticesEqualWholeSurface) {
  const Body body = golden_body();
  const Pose pose = pose_on(golden_motion(golden().at("poses").at(1)), body, 0);
  const Points all = pose_surface(body, pose);
  const std::vector<int32_t> pick = {199, 0, 7, 7, 101};
  const Points some = pose_surface(body, pose, &pick);
  ASSERT_EQ(some.size(), pick.size());
  for (size_t i = 0; i < pick.size(); ++i) EXPECT_EQ(some[i], all[static_cast<size_t>(pick[i])]);
}

TEST(GeometryBody, BentElbowKeepsVolumeAndSwells) {
  const Body body = arm_tube();
  Pose pose = rest_pose(body);
  pose.local[18] = Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitY()).toRotationMatrix();
  const double rest = tube_volume(body.rest.vertices);
  const Points blended = linear_blend_skinning(body, pose), better = pose_surface(body, pose);
  EXPECT_LT(tube_volume(blended), 0.985 * rest);
  EXPECT_GT(tube_volume(better), tube_volume(blended) * 1.01);
  EXPECT_LT(tube_volume(better), 1.15 * rest);
  EXPECT_GT(distance(blended, better), 0.01);

  // The biceps: half of the upper arm's length from the shoulder, on the side the forearm went to.
  const double x = 0.5 * (body.joints[16].x() + body.joints[18].x());
  double front = 0, back = 0;
  for (size_t i = 0; i < better.size(); ++i) {
    const Point& v = body.rest.vertices[i];
    if (std::abs(v.x() - x) > 0.012f) continue;
    front = std::max<double>(front, better[i].z() - body.joints[18].z());
    back = std::max<double>(back, body.joints[18].z() - better[i].z());
  }
  EXPECT_GT(front, 0.055);        // swollen
  EXPECT_NEAR(back, 0.05, 5e-4);  // as it was
}

TEST(GeometryBody, QuaternionSignDoesNotTearTheSurface) {
  // Upper arm turned by 200 degrees as a whole: neighbouring joints' quaternions have other signs.
  const Body body = arm_tube();
  for (int degrees = 0; degrees <= 360; degrees += 10) {
    Pose pose = rest_pose(body);
    pose.local[16] = Eigen::AngleAxisd(degrees * M_PI / 180, Vec3::UnitX()).toRotationMatrix();
    pose.local[18] = Eigen::AngleAxisd(0.5, Vec3::UnitX()).toRotationMatrix();
    const Points skin = pose_surface(body, pose);
    for (const Point& v : skin) {
      const double y = v.y() - body.joints[18].y(), z = v.z() - body.joints[18].z();
      ASSERT_NEAR(std::hypot(y, z), 0.05, 2e-2) << degrees;  // joints are not exactly on one line
    }
  }
}

TEST(GeometryBody, WrongSizesAreShapeErrors) {
  Body body = golden_body();
  const Pose pose = rest_pose(body);
  const std::vector<int32_t> pick = {200}, negative = {-1};
  EXPECT_THROW(pose_surface(body, pose, &pick), ShapeError);
  EXPECT_THROW(pose_surface(body, pose, &negative), ShapeError);
  EXPECT_THROW(pose_on(Motion(), body, 0), ShapeError);
  const auto shapes = std::make_shared<PoseBlendShapes>();
  shapes->directions.setZero(3, PoseBlendShapes::kFeatures);
  body.blend_shapes = shapes;
  EXPECT_THROW(pose_surface(body, pose), ShapeError);
  body.blend_shapes = nullptr;
  body.rest.vertices.pop_back();
  EXPECT_THROW(pose_surface(body, pose), ShapeError);
  EXPECT_THROW(linear_blend_skinning(body, pose), ShapeError);
}

}  // namespace
}  // namespace restage
