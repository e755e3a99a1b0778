// The second look of the small extractor: what it sees and answers turns with the body.
#include "nn/models/second_look.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/rotation.h"
#include "nn/geometry/body.h"
#include "nn/models/registry.h"

namespace restage {
namespace {

constexpr int64_t kPoints = 200;

SecondLook look() { return SecondLook(16, 32, 4, Init{RngKey{1, 0}, DType::f32}); }

struct Scene {
  Tensor cloud = gradcheck::random({2, kPoints, 3}, 1, 0.3).cast(DType::f32);
  SkeletonAnswer first;
};

Scene scene() {
  Scene out;
  out.first.joints = Var(gradcheck::random({2, kJoints, 3}, 2, 0.3).cast(DType::f32));
  out.first.turns = Var(gradcheck::random({2, kJoints, 6}, 3).cast(DType::f32));
  out.first.uncertainty = Var(gradcheck::random({2, kJoints}, 4).cast(DType::f32));
  return out;
}

/// Rows of three numbers, each turned and moved.
Tensor placed(const Tensor& rows, const Mat3& turn, const Vec3& by = Vec3::Zero()) {
  Tensor out = rows.clone();
  for (float* p = out.data<float>(); p != out.data<float>() + out.numel(); p += 3)
    Eigen::Map<Point>{p} = (turn * Eigen::Map<Point>(p).cast<double>() + by).cast<float>();
  return out;
}

double farthest(const Tensor& a, const Tensor& b) {
  EXPECT_EQ(a.shape(), b.shape());
  double out = 0;
  for (int64_t i = 0; i < a.numel(); ++i)
    out = std::max(out, std::abs(static_cast<double>(a.data<float>()[i]) - b.data<float>()[i]));
  return out;
}

TEST(SecondLook, AnswersTurnAndMoveWithWhatItSees) {
  const SecondLook model = look();
  Context ctx;
  const Scene here = scene();
  const SkeletonAnswer seen = model(ctx, here.cloud, here.first);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
  const Vec3 by(0.2, -0.1, 0.4);
  Scene there;
  there.cloud = placed(here.cloud, turn, by);
  there.first = here.first;
  there.first.joints = Var(placed(here.first.joints.value, turn, by));
  there.first.turns = Var(placed(here.first.turns.value, turn));
  const SkeletonAnswer moved = model(ctx, there.cloud, there.first);
  EXPECT_LT(farthest(moved.joints.value, placed(seen.joints.value, turn, by)), 1e-5);
  EXPECT_LT(farthest(moved.turns.value, placed(seen.turns.value, turn)), 1e-4);
  EXPECT_LT(farthest(moved.uncertainty.value, seen.uncertainty.value), 1e-4);
}

TEST(SecondLook, BeginsAsTheFirst) {
  const SecondLook model = look();
  Context ctx;
  const Scene s = scene();
  const SkeletonAnswer seen = model(ctx, s.cloud, s.first);
  EXPECT_LT(farthest(seen.joints.value, s.first.joints.value), 2e-3);
  EXPECT_GT(farthest(seen.joints.value, s.first.joints.value), 0);
  const Var orthonormal = matrix_to_sixd(sixd_to_matrix(s.first.turns));
  EXPECT_LT(farthest(seen.turns.value, orthonormal.value), 0.1);
  EXPECT_LT(farthest(seen.uncertainty.value, s.first.uncertainty.value), 0.1);
}

TEST(SecondLook, WhatIsNotKnownIsNotAnswered) {
  const SecondLook model = look();
  Context ctx;
  const Scene s = scene();
  SkeletonAnswer joints;
  joints.joints = s.first.joints;
  const SkeletonAnswer seen = model(ctx, s.cloud, joints);
  EXPECT_LT(farthest(seen.joints.value, s.first.joints.value), 2e-3);
  EXPECT_FALSE(seen.turns.value.defined());
  EXPECT_FALSE(seen.uncertainty.value.defined());
}

TEST(SecondLook, SeesPointsNearAJoint) {
  const SecondLook model = look();
  Context ctx;
  Scene s = scene();
  const Tensor before = model(ctx, s.cloud, s.first).joints.value;
  // Far from every joint, behind all that are near: another place there is not seen.
  float* far = s.cloud.data<float>();
  Eigen::Map<Point>{far} = Point(40, 0, 0);
  const Tensor with = model(ctx, s.cloud, s.first).joints.value;
  Eigen::Map<Point>{far} = Point(50, 3, 0);
  EXPECT_EQ(farthest(model(ctx, s.cloud, s.first).joints.value, with), 0);
  Eigen::Map<Point>{far} = Eigen::Map<const Point>(s.first.joints.value.data<float>());
  EXPECT_GT(farthest(model(ctx, s.cloud, s.first).joints.value, with), 0);
}

TEST(SecondLook, AnExtractorKeepsWhatItBelievedBefore) {
  const std::vector<std::string> sizes = {"points=96",   "width=32",         "layers=1",
                                          "centres=24",  "neighbours=8",     "looks=3",
                                          "memory=true", "orientation=true", "uncertainty=true"};
  const auto model = make_model_as<SkeletonModel>("skeleton/patch_transformer",
                                                  model_config("skeleton/patch_transformer", sizes),
                                                  Init{RngKey{1, 0}, DType::f32});
  const auto once = make_model_as<SkeletonModel>(
      "skeleton/patch_transformer",
      model_config("skeleton/patch_transformer",
                   {"points=96", "width=32", "layers=1", "centres=24", "neighbours=8",
                    "memory=true", "orientation=true", "uncertainty=true"}),
      Init{RngKey{1, 0}, DType::f32});
  const Tensor points = gradcheck::random({3, 96, 3}, 7, 0.4).cast(DType::f32);
  Context ctx;
  const SkeletonOutput out = model->forward(ctx, points), first = once->forward(ctx, points);
  ASSERT_EQ(out.before.size(), 2u);
  EXPECT_TRUE(first.before.empty());
  EXPECT_EQ(farthest(out.before[0].joints.value, first.joints.value), 0);
  EXPECT_EQ(farthest(out.before[0].uncertainty.value, first.uncertainty.value), 0);
  EXPECT_GT(farthest(out.joints.value, out.before[1].joints.value), 0);
  EXPECT_GT(farthest(out.before[1].joints.value, out.before[0].joints.value), 0);
}

}  // namespace
}  // namespace restage
