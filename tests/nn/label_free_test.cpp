// What joints show without a truth: each figure on a sequence whose answer is known.
#include "nn/metrics/label_free.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/base/rng.h"

namespace restage::metrics {
namespace {

/// A stick figure: left limbs at +x, right ones at -x, half a metre apart, at `height`.
Joints figure(double x) {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j) {
    const bool left = kJointNames[j].starts_with("left"),
               right = kJointNames[j].starts_with("right");
    out[j] = Vec3(x + (left ? 0.25 : right ? -0.25 : 0), 0.05 * static_cast<double>(j), 0);
  }
  return out;
}

std::vector<Joints> walk(size_t n) {
  std::vector<Joints> out;
  for (size_t t = 0; t < n; ++t) out.push_back(figure(0.01 * static_cast<double>(t * t) / 10));
  return out;
}

TEST(LabelFree, BonesOfConstantLengthHaveNoSpread) {
  std::vector<Joints> frames = walk(9);
  const auto constant = bone_length_spread(frames);
  for (const double sd : *constant) EXPECT_NEAR(sd, 0, 1e-12);
  // Lengths 0.3 + 0.01 and 0.3 - 0.01 in turn: a standard deviation of 0.01 sqrt(n / (n - 1)).
  frames.resize(8);
  for (size_t t = 0; t < 8; ++t) {
    const Vec3 from = frames[t][kLeftElbow];
    frames[t][kLeftWrist] = from + Vec3(0, 0, t % 2 == 0 ? 0.31 : 0.29);
  }
  EXPECT_NEAR((*bone_length_spread(frames))[kLeftWrist], 0.01 * std::sqrt(8.0 / 7), 1e-12);
  EXPECT_FALSE(bone_length_spread(std::span(frames).first(1)));
}

TEST(LabelFree, LegsThatChangeSidesAreSeen) {
  std::vector<Joints> frames = walk(12);
  for (const bool changed : side_changes(frames)) EXPECT_FALSE(changed);
  for (size_t t = 4; t < 7; ++t)
    for (const int j : {kLeftHip, kLeftKnee, kLeftAnkle, kLeftFoot})
      std::swap(frames[t][static_cast<size_t>(j)],
                frames[t][static_cast<size_t>(kMirror[static_cast<size_t>(j)])]);
  const std::vector<bool> changed = side_changes(frames);
  for (size_t t = 0; t < 12; ++t) EXPECT_EQ(changed[t], t >= 4 && t < 7) << t;
}

TEST(LabelFree, TheRarerSideCountsAsChanged) {
  std::vector<Joints> frames = walk(12);
  for (size_t t = 3; t < 12; ++t)
    for (const int j : {kLeftElbow, kLeftWrist})
      std::swap(frames[t][static_cast<size_t>(j)],
                frames[t][static_cast<size_t>(kMirror[static_cast<size_t>(j)])]);
  const std::vector<bool> changed = side_changes(frames);
  for (size_t t = 0; t < 12; ++t) EXPECT_EQ(changed[t], t < 3) << t;
}

TEST(LabelFree, AParabolaDoesNotShakeAndNoiseDoes) {
  std::vector<Joints> frames = walk(20);
  for (const double x : jitter(frames)) EXPECT_NEAR(x, 0, 1e-12);
  EXPECT_TRUE(jitter(std::span(frames).first(6)).empty());
  // One joint of one frame off by d: the parabola keeps a third of it.
  frames[10][kHead] += Vec3(0, 0.21, 0);
  const std::vector<double> shaking = jitter(frames);
  EXPECT_NEAR(shaking[10], 0.21 * 2 / 3 / kJoints, 1e-12);
  EXPECT_EQ(shaking[0], 0);
  EXPECT_EQ(shaking[19], 0);
}

TEST(LabelFree, TheFloorIsWherePeopleStand) {
  // Standing within 4 mm of a floor at 1 m, and a jump.
  std::vector<double> lowest;
  for (int t = 0; t < 40; ++t) lowest.push_back(1 + 0.001 * (t % 5));
  for (int t = 0; t < 10; ++t) lowest.push_back(1.5);
  EXPECT_NEAR(*floor_spread(lowest), 0.002, 1e-12);
  EXPECT_FALSE(floor_spread({}));
}

}  // namespace
}  // namespace restage::metrics
