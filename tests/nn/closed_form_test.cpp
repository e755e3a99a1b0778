#include "nn/geometry/closed_form.h"

#include <gtest/gtest.h>

#include "autograd/base/rng.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_joints;

Pose random_pose(uint64_t seed) {
  Rng rng({seed, 0});
  Pose pose;
  for (Mat3& local : pose.local) {
    const Vec3 axis(rng.normal(), rng.normal(), rng.normal());
    local = Eigen::AngleAxisd(0.6 * rng.normal(), axis.normalized()).toRotationMatrix();
  }
  pose.root = Vec3(rng.normal(), 1, rng.normal());
  return pose;
}

TEST(ClosedForm, ReturnsTheJointsOfASkeletonOnItself) {
  const Joints rest = tiny_joints();
  std::vector<Joints> motion;
  for (uint64_t f = 0; f < 20; ++f)
    motion.push_back(forward_kinematics(rest, random_pose(f)).joints);
  const auto result = closed_form_joints(motion, rest);
  ASSERT_EQ(result.size(), motion.size());
  for (size_t f = 0; f < motion.size(); ++f)
    for (int j = 0; j < kJoints; ++j)
      EXPECT_LT((result[f][j] - motion[f][j]).norm(), 1e-9) << f << " " << kJointNames[j];
}

TEST(ClosedForm, ScalesTheTrajectoryByLegLength) {
  const Joints small = tiny_joints(1.5), tall = tiny_joints(1.8);
  std::vector<Joints> motion;
  for (uint64_t f = 0; f < 4; ++f)
    motion.push_back(forward_kinematics(small, random_pose(f)).joints);
  const double scale = 1.8 / 1.5;
  EXPECT_NEAR(trajectory_scale(motion[0], tall), scale, 1e-12);
  const auto moved = closed_form_joints(motion, tall), rigid = rest_pose_joints(motion, tall);
  for (size_t f = 0; f < motion.size(); ++f) {
    EXPECT_LT((moved[f][0] - scale * motion[f][0]).norm(), 1e-12);
    EXPECT_LT((rigid[f][0] - scale * motion[f][0]).norm(), 1e-12);
    EXPECT_LT((rigid[f][15] - rigid[f][0] - (tall[15] - tall[0])).norm(), 1e-12);
    // The same shape of body: everything is scaled.
    for (int j = 0; j < kJoints; ++j) EXPECT_LT((moved[f][j] - scale * motion[f][j]).norm(), 1e-9);
  }
}

TEST(ClosedForm, SourceRestRemovesTheDifferenceOfRestPoses) {
  const Joints target = tiny_joints();
  Joints source = tiny_joints();
  source[4].x() += 0.1;  // legs spread
  source[7].x() += 0.2;
  source[10].x() += 0.2;
  const std::vector<Joints> motion{source};
  const auto blind = closed_form(motion, target), informed = closed_form(motion, target, source);
  EXPECT_GT((blind[0].local[1] - Mat3::Identity()).norm(), 0.05);
  for (const Mat3& local : informed[0].local) EXPECT_LT((local - Mat3::Identity()).norm(), 1e-9);
}

TEST(ClosedForm, DegenerateSkeletonsGiveRotations) {
  Joints collapsed;
  collapsed.fill(Vec3(1, 2, 3));
  const Joints rest = tiny_joints();
  for (const auto& [a, b] : {std::pair{rest, collapsed}, {collapsed, rest}, {collapsed, collapsed}})
    for (const Pose& pose : closed_form({a}, b))
      for (const Mat3& local : pose.local) {
        EXPECT_LT((local * local.transpose() - Mat3::Identity()).norm(), 1e-9);
        EXPECT_NEAR(local.determinant(), 1.0, 1e-9);
      }
  EXPECT_EQ(trajectory_scale(collapsed, rest), 1.0);
  EXPECT_TRUE(closed_form({}, rest).empty());
}

}  // namespace
}  // namespace restage
