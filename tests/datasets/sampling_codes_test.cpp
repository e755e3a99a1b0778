// What H4D's codes mean (principal components, a linear body, a basis of motions), and its windows.
#include <gtest/gtest.h>

#include "autograd/ops/layout.h"
#include "datasets/sampling/code_spaces.h"
#include "datasets/sampling/code_windows.h"
#include "datasets/sampling/principal.h"
#include "tests/datasets/sampling_support.h"
#include "tests/support/errors.h"
#include "tests/support/expect_near.h"

namespace restage {
namespace {

using testing::training_corpus;

Eigen::MatrixXd random_rows(Eigen::Index n, Eigen::Index d) {
  Rng rng(RngKey{3, 0});
  Eigen::MatrixXd out(n, d);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; k < d; ++k)
      out(i, k) = rng.uniform() * static_cast<double>(d - k) + static_cast<double>(k);
  return out;
}

TEST(PrincipalComponents, AllOfThemGiveTheRowsBack) {
  for (const auto& [n, d] : {std::pair{6, 9}, std::pair{40, 7}}) {
    const Eigen::MatrixXd rows = random_rows(n, d);
    const Principal all = principal_components(rows, 100);
    ASSERT_EQ(all.components.rows(), std::min(n - 1, d));
    const Eigen::MatrixXd centred = rows.rowwise() - all.mean.transpose();
    const Eigen::MatrixXd numbers = centred * all.components.transpose();
    EXPECT_LT((numbers * all.components - centred).norm(), 1e-9 * centred.norm());
    const Eigen::MatrixXd angles = all.components * all.components.transpose();
    EXPECT_LT((angles - Eigen::MatrixXd::Identity(angles.rows(), angles.rows())).norm(), 1e-9);
    for (Eigen::Index k = 0; k < all.deviations.size(); ++k)
      EXPECT_NEAR(all.deviations[k], numbers.col(k).norm() / std::sqrt(n), 1e-9);
    EXPECT_EQ(principal_components(rows, 2).components, all.components.topRows(2));
  }
  EXPECT_EQ(principal_components(Eigen::MatrixXd::Ones(4, 5), 3).components.rows(), 0);
}

TEST(LinearBodies, AllDirectionsGiveTheBodiesBack) {
  const std::vector<Body>& bodies = training_corpus().bodies;
  const LinearBody fit = fit_linear_body(bodies, 10);
  const int64_t v = std::ssize(bodies[0].rest.vertices);
  ASSERT_EQ(fit.directions.shape(), (Shape{v, 3, 2}));  // three bodies differ in two ways
  double sum = 0, squares = 0;
  for (const Body& body : bodies) {
    const auto shape = nearest_shape(fit.mean, fit.directions, body.rest.vertices);
    const Var code(Tensor::from<float>({1, 2}, shape));
    const Tensor made = shaped(fit.mean, fit.directions, code).value;
    const Tensor joints = shaped(fit.joint_mean, fit.joint_directions, code).value;
    for (int64_t i = 0; i < v; ++i)
      EXPECT_LT(
          (testing::at(made, 0, i) - body.rest.vertices[static_cast<size_t>(i)].cast<double>())
              .norm(),
          1e-5);
    for (int64_t j = 0; j < kJoints; ++j)
      EXPECT_LT((testing::at(joints, 0, j) - body.joints[static_cast<size_t>(j)]).norm(), 1e-5);
    for (const float x : shape) sum += x, squares += x * x;
  }
  EXPECT_NEAR(sum, 0, 1e-4);
  EXPECT_NEAR(squares / 6, 1, 1e-4);
}

TEST(RotationVectors, DoNotJumpAtAHalfTurn) {
  const Vec3 axis = Vec3(1, 2, -1).normalized();
  Vec3 before = Vec3::Zero();
  for (int i = 0; i <= 100; ++i) {
    const double angle = 0.1 * i;  // one and a half turns
    const Eigen::AngleAxisd turn{Quat(Eigen::AngleAxisd(angle, axis).toRotationMatrix())};
    before = without_jump(turn.angle() * turn.axis(), before);
    EXPECT_LT((before - angle * axis).norm(), 1e-6) << i;
  }
  EXPECT_LT((without_jump(Vec3::Zero(), 6.2 * axis) - 2 * M_PI * axis).norm(), 1e-6);
}

CodeWindowConfig small_windows() {
  CodeWindowConfig c;
  c.frames = 6;
  c.points = 40;
  c.heading = 180;
  return c;
}

TEST(MotionBases, AllComponentsGiveTheWindowsBack) {
  const CodeWindowSampler sampler(training_corpus(), small_windows(), {0}, 3);
  const int64_t n = 12;
  const Tensor poses = sampler.poses(0, n);
  const MotionBasis basis = fit_motion_basis(poses, 100, 1000);
  const auto codes = [&](int64_t from, int64_t width, const Tensor& components,
                         const Tensor& mean) {
    const auto rows = components.size(0), d = components.size(1);
    std::vector<float> out;
    for (int64_t i = 0; i < n; ++i)
      for (int64_t k = 0; k < rows; ++k) {
        double sum = 0;
        for (int64_t c = 0; c < d; ++c) {
          const int64_t at = (i * 6 + 1 + c / width) * 66 + from + c % width;
          const double change = poses.item(at) - poses.item(i * 6 * 66 + from + c % width);
          sum += (change - mean.item(c)) * components.item(k * d + c);
        }
        out.push_back(static_cast<float>(sum));
      }
    return Var(Tensor::from<float>({n, rows}, out));
  };
  const Var motion = concat(
      {codes(0, 3, basis.root, basis.root_mean), codes(3, 63, basis.joints, basis.joint_mean)}, 1);
  const Var first = reshape(slice(Var(poses), 1, 0, 1), {n, 66});
  expect_near(h4d_poses(first, motion, basis).value, poses, 1e-4, "poses");
  EXPECT_EQ(fit_motion_basis(poses, 2, 3).joints.size(0), 3);
}

TEST(CodeWindows, SamplesAreFunctionsOfTheirNumber) {
  const CodeWindowSampler sampler(training_corpus(), small_windows(), {3, 8, 100}, 7);
  const CodeWindowBatch all = sampler.batch(3, 4), one = sampler.batch(5, 1);
  EXPECT_EQ(all.clouds.shape(), (Shape{4, 6, 40, 3}));
  EXPECT_EQ(all.truth.shape(), (Shape{4, 6, 3, 3}));
  EXPECT_TRUE(testing::same_bits(all.clouds.rows(2, 3), one.clouds));
  EXPECT_TRUE(testing::same_bits(all.truth.rows(2, 3), one.truth));
  EXPECT_TRUE(testing::same_bits(all.rest.rows(2, 3), one.rest));
  EXPECT_EQ(all.body.item(2), one.body.item(0));
  EXPECT_TRUE(testing::same_bits(sampler.poses(3, 4).rows(2, 3), sampler.poses(5, 1)));
}

/// The truth is the body in the poses that the sampler says, the pelvis where it rests; clouds lie
/// about their own middle.
TEST(CodeWindows, TruthIsTheBodyInThosePoses) {
  const CodeWindowSampler sampler(training_corpus(), small_windows(), {3, 8, 100}, 7);
  const CodeWindowBatch b = sampler.batch(0, 2);
  const Tensor poses = sampler.poses(0, 2);
  for (int64_t i = 0; i < 2; ++i) {
    const Body& body = training_corpus().bodies[static_cast<size_t>(b.body.item(i))];
    for (int64_t t = 0; t < 6; ++t) {
      Pose pose;
      pose.root = body.joints[0];
      for (int64_t j = 0; j < kJoints; ++j) {
        const Vec3 turn = testing::at(poses, i, t * kJoints + j);
        pose.local[static_cast<size_t>(j)] =
            Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
      }
      const Points posed = pose_surface(body, pose, &sampler.vertices());
      for (int64_t k = 0; k < 3; ++k)
        EXPECT_LT(
            (testing::at(b.truth, i, t * 3 + k) - posed[static_cast<size_t>(k)].cast<double>())
                .norm(),
            1e-4);
      Vec3 sum = Vec3::Zero();
      for (int64_t k = 0; k < 40; ++k) sum += testing::at(b.clouds, i, t * 40 + k);
      EXPECT_LT(sum.norm(), 1e-3);
    }
  }
}

TEST(CodeSpaces, WhatCannotBeIsRefused) {
  std::vector<Body> bodies = training_corpus().bodies;
  const auto refused = [&] { return test::refusal_of([&] { fit_linear_body(bodies, 3); }); };
  bodies[1].rest.faces.pop_back();
  EXPECT_HAS(refused(), "one topology");
  bodies.resize(1);
  EXPECT_HAS(refused(), "two bodies");
  bodies.push_back(bodies[0]);
  EXPECT_HAS(refused(), "the same");
  CodeWindowConfig c = small_windows();
  c.frame_step = 1000;
  EXPECT_HAS(test::refusal_of([&] { CodeWindowSampler(training_corpus(), c, {0}, 1); }), "frames");
  EXPECT_HAS(
      test::refusal_of([&] { CodeWindowSampler(training_corpus(), small_windows(), {1000}, 1); }),
      "no vertex");
  EXPECT_HAS(test::refusal_of([&] {
               fit_motion_basis(Tensor::zeros({4, 3, 66}), 2, 2);
             }),
             "no change of pose");
}

}  // namespace
}  // namespace restage
