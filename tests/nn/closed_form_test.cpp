#include "nn/geometry/closed_form.h"

#include <gtest/gtest.h>

#include "autograd/base/rng.h"
#include "nn/models/motion.h"
#include "nn/models/registry.h"
#include "tests/support/closed_form_joints.h"
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

TEST(ClosedForm, ReadsTwistFromMeasuredRotations) {
  const Body body = testing::tiny_body("a", "test");
  const Motion motion = testing::tiny_motion("m", "s", "test", 8);
  double largest = 0;
  for (size_t f = 0; f < 8; ++f) {
    const Pose pose = pose_on(motion, body, f);
    const PosedSkeleton true_pose = forward_kinematics(body.joints, pose);
    const TwistReading read = read_twist(body.joints, true_pose.joints, true_pose.global);
    for (size_t j = 0; j < kJoints; ++j) {
      const bool leaf = std::count(kParents.begin(), kParents.end(), static_cast<int>(j)) == 0;
      const Mat3 left = leaf ? pose.local[j] : Mat3(Mat3::Identity());
      EXPECT_LT((read.beyond[j] - left).norm(), 1e-6) << f << " " << kJointNames[j];
      largest = std::max(largest, std::abs(read.twist[j]));
    }
  }
  EXPECT_GT(largest, 0.1) << "nothing was twisted";
  // A twist that is put on is read.
  Rotations turned = closed_form_rotations(body.joints, body.joints);
  turned[18] =
      Eigen::AngleAxisd(0.7, (body.joints[20] - body.joints[18]).normalized()) * turned[18];
  EXPECT_NEAR(read_twist(body.joints, body.joints, turned).twist[18], 0.7, 1e-9);
}

TEST(ClosedForm, IsAMotionModel) {
  const Joints rest = tiny_joints(1.2);
  std::vector<Joints> motion;
  for (uint64_t f = 0; f < 6; ++f)
    motion.push_back(forward_kinematics(tiny_joints(1.8), random_pose(f)).joints);
  const auto expected = closed_form_joints(motion, rest);
  const auto model = make_model_as<MotionModel>(
      "motion/closed_form", model_config("motion/closed_form"), Init{RngKey{1, 0}, DType::f64});
  const auto rows = [](const Joints& joints, int64_t frames, const std::vector<Joints>& all) {
    std::vector<double> values;
    for (const Joints& one : all)
      for (const Vec3& p : one)
        for (int c = 0; c < 3; ++c)
          values.push_back(p[c] - (all.size() > 1 ? one[0][c] : joints[0][c]));
    return Tensor::from<double>(
        all.size() > 1 ? Shape{1, frames, kJoints, 3} : Shape{1, kJoints, 3}, values);
  };
  const Tensor a = rows(rest, 6, motion), b = rows(rest, 1, {rest});
  const Tensor velocity = Tensor::full({1, 6, 3}, 2, DType::f64);
  Context ctx;
  MotionState whole, pieces;
  const MotionOutput all = model->forward(ctx, {a, velocity, b, {}, {}}, &whole);
  for (int64_t f = 0; f < 6; ++f) {
    const Tensor one = Tensor::from<double>(
        {1, 1, kJoints, 3},
        {a.data<double>() + f * 3 * kJoints, a.data<double>() + (f + 1) * 3 * kJoints});
    const MotionOutput out =
        model->forward(ctx, {one, Tensor::full({1, 1, 3}, 2, DType::f64), b, {}, {}}, &pieces);
    for (int j = 0; j < kJoints; ++j)
      for (int c = 0; c < 3; ++c) {
        const double whole_value = all.joints.value.data<double>()[(f * kJoints + j) * 3 + c];
        EXPECT_EQ(out.joints.value.data<double>()[3 * j + c], whole_value);
        const auto& frame = expected[static_cast<size_t>(f)];
        EXPECT_NEAR(whole_value, frame[j][c] - frame[0][c], 1e-12);
      }
    EXPECT_NEAR(out.trans.value.data<double>()[0], 2 * trajectory_scale(motion[0], rest), 1e-12);
  }
}

}  // namespace
}  // namespace restage
