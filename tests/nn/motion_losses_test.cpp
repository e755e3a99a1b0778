// The losses of motion: NKN's twist.
#include "nn/losses/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/evaluate.h"

namespace restage {
namespace {

using gradcheck::random;

constexpr double kPi = 3.14159265358979323846;

/// Rotations [1, 1, j, 3, 3] whose R00 and R20 belong to angles about y, degrees.
Tensor about_y(const std::vector<double>& angles, double radius = 1) {
  const auto j = static_cast<int64_t>(angles.size());
  Tensor r = random({1, 1, j, 3, 3}, 1);
  for (size_t i = 0; i < angles.size(); ++i) {
    r.data<double>()[9 * i] = radius * std::cos(angles[i] * kPi / 180);
    r.data<double>()[9 * i + 6] = -radius * std::sin(angles[i] * kPi / 180);
  }
  return r;
}

TEST(TwistLoss, IsTheSquaredExcessOverAHundredDegrees) {
  const auto loss = [](const Tensor& r) { return twist_loss(Var(r)).value.item(); };
  const double unit = std::pow(10 * kPi / 180, 2);  // ten degrees too many
  EXPECT_DOUBLE_EQ(loss(about_y({170, 99, -99, 0})), 0) << "the root may turn";
  EXPECT_NEAR(loss(about_y({0, 110, -120, 60})), unit * (1 + 4) / 3, 1e-12);
  EXPECT_NEAR(loss(about_y({0, 110, -120, 60}).cast(DType::f32)), unit * (1 + 4) / 3, 1e-6);
}

TEST(TwistLoss, PassesTheGradientHarness) {
  gradcheck::OpSamples s{"twist_loss", ""};
  s.add("some beyond the limit", {about_y({150, 110, -130, 60, -20, 170})},
        [](gradcheck::Args x) { return twist_loss(x[0]); });
  s.add("off the unit circle", {about_y({10, 110, -130, 60}, 0.3)},
        [](gradcheck::Args x) { return twist_loss(x[0]); });
  for (const gradcheck::Sample& sample : s.samples) {
    const gradcheck::Report r = check_sample(s, sample);
    EXPECT_TRUE(r.ok()) << r.text();
  }
}

TEST(TwistLoss, HasNoGradientWhereTheAngleMeansNothing) {
  Tape tape;
  const Var r = tape.leaf(about_y({0, 180, 120}, 1e-9), 1);  // gimbal lock
  const Gradients g = tape.backward(twist_loss(r));
  for (const double v : g.find(1)->to_vector<double>()) EXPECT_EQ(v, 0);
}

}  // namespace
}  // namespace restage
