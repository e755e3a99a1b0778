// Clouds of which something is hidden, with few points or much noise, and people who are turned.
#include "datasets/sampling/partial.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "autograd/base/error.h"
#include "datasets/sampling/clouds.h"
#include "nn/geometry/skeleton.h"
#include "tests/datasets/sampling_support.h"

namespace restage {
namespace {

using namespace testing;

CloudBatch batch_of(const CloudConfig& config, int64_t n = 40) {
  return CloudSampler(training_corpus(), config, 4).batch(0, n);
}

size_t distinct_points(const CloudBatch& batch, int64_t row) {
  std::set<std::array<double, 3>> out;
  for (int64_t k = 0; k < batch.points.size(1); ++k) {
    const Vec3 p = at(batch.points, row, k);
    out.insert({p.x(), p.y(), p.z()});
  }
  return out.size();
}

/// Joints 0 and `kNeck` of a row as a trunk.
double angle_of_trunk(const CloudBatch& batch, int64_t row) {
  const Vec3 trunk = at(batch.joints, row, kNeck) - at(batch.joints, row, kPelvis);
  return std::acos(trunk.normalized().y());
}

TEST(SamplingPartial, ACutHidesItsShareAndKeepsNumbersBesidePoints) {
  Points points;
  for (int i = 0; i < 1000; ++i) points.emplace_back(0.0f, static_cast<float>(i) / 999.0f, 0.0f);
  std::vector<size_t> which(1000);
  std::iota(which.begin(), which.end(), size_t{0});
  cut_away({Point::UnitY(), 0.4}, points, which);
  ASSERT_EQ(points.size(), which.size());
  EXPECT_NEAR(static_cast<double>(points.size()), 600, 1);
  for (size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(points[i].y(), static_cast<float>(which[i]) / 999.0f);
  cut_away({Point::UnitY(), 0.95}, points, which);
  EXPECT_NEAR(static_cast<double>(points.size()), 600, 1) << "30 points are no cloud";
}

TEST(SamplingPartial, DesksHideWhatIsBelow) {
  Rng rng(RngKey{1, 0});
  int desks = 0, hips = 0;
  for (int i = 0; i < 3000; ++i) {
    const Cut cut = draw_cut(rng);
    EXPECT_NEAR(static_cast<double>(cut.towards.norm()), 1, 1e-5);
    EXPECT_GE(cut.share, 0.05);
    EXPECT_LE(cut.share, 0.6);
    if (cut.towards != Point::UnitY()) continue;
    ++desks;
    hips += cut.share > 0.45;
  }
  EXPECT_NEAR(desks / 3000.0, 0.6, 0.05);
  EXPECT_GT(hips / 1.0 / desks, 0.4);
}

TEST(SamplingPartial, SparseCloudsHaveAllNumbersOfPoints) {
  const CloudBatch sparse = batch_of({.points = 512, .sparse = 1});
  int below_128 = 0, above_256 = 0;
  for (int64_t i = 0; i < 40; ++i) {
    const size_t n = distinct_points(sparse, i);
    EXPECT_GE(n, kLeastPoints);
    below_128 += n < 128;
    above_256 += n > 256;
  }
  EXPECT_GT(below_128, 5);
  EXPECT_GT(above_256, 5);
}

TEST(SamplingPartial, ACroppedCloudIsSmaller) {
  const CloudBatch whole = batch_of({.points = 512}), cut = batch_of({.points = 512, .cropped = 1});
  const auto extent = [](const CloudBatch& b, int64_t row) {
    Eigen::AlignedBox3d box;
    for (int64_t k = 0; k < 512; ++k) box.extend(at(b.points, row, k));
    return box.sizes().sum();
  };
  int smaller = 0, posed = 0;
  const CloudSampler sampler(training_corpus(), {.points = 512, .cropped = 1}, 4);
  for (int64_t i = 0; i < 40; ++i) {
    if (sampler.subject(i).rest) continue;
    ++posed;
    smaller += extent(cut, i) < 0.99 * extent(whole, i);
  }
  EXPECT_GT(smaller, 0.8 * posed);
}

TEST(SamplingPartial, NoiseIsAddedUpToTheMost) {
  const CloudSampler sampler(training_corpus(), {.noise = 0.005, .noisy = 0.5}, 4);
  int noisy = 0;
  double most = 0;
  for (int64_t i = 0; i < 1000; ++i) {
    const double noise = sampler.subject(i).noise;
    if (noise == 0) continue;
    ++noisy;
    EXPECT_GE(noise, 0.0049);
    EXPECT_LE(noise, 0.0451);
    most = std::max(most, noise);
  }
  EXPECT_NEAR(noisy / 1000.0, 0.5, 0.08);
  EXPECT_GT(most, 0.04);
}

TEST(SamplingPartial, SettingsThatMeanNothingAreRefused) {
  EXPECT_NO_THROW(batch_of({.points = 64, .noise = 0.06}, 1)) << "nobody asked for more noise";
  EXPECT_THROW(batch_of({.points = 64, .noise = 0.06, .noisy = 0.1}, 1), InputError);
  EXPECT_THROW(batch_of({.points = 64, .noisy = 0.1, .most_noise = 1e30}, 1), InputError);
  EXPECT_THROW(batch_of({.points = 64, .ceiling = 0.5}, 1), InputError) << "no camera";
  EXPECT_THROW(batch_of({.points = 64, .tilted = 1.5}, 1), InputError);
}

TEST(SamplingPartial, WhatIsShownTurnedIsTurnedAsAWhole) {
  const CloudSampler sampler(training_corpus(), {.points = 256, .noise = 0, .rotations = true}, 1);
  CloudSubject plain;
  plain.at = {0, 20};
  CloudSubject turned = plain;
  turned.shown = Mat3(Eigen::AngleAxisd(1.1, Vec3(1, 0, 2).normalized()));
  const CloudBatch a = sampler.clouds({plain}), b = sampler.clouds({turned});
  for (int p = 0; p < 256; ++p)
    EXPECT_LT((turned.shown * at(a.points, 0, p) - at(b.points, 0, p)).norm(), 1e-5);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((turned.shown * at(a.joints, 0, j) - at(b.joints, 0, j)).norm(), 1e-5);
  for (int c = 0; c < 2 * kJoints; ++c)
    EXPECT_LT((turned.shown * at(a.turns, 0, c) - at(b.turns, 0, c)).norm(), 1e-5);
}

TEST(SamplingPartial, TheMemoryIsTurnedWithTheCloud) {
  CloudConfig config{.points = 128, .tpose_share = 0, .tilted = 1, .remembered = 1};
  const CloudBatch batch = batch_of(config);
  double far = 0, tilt = 0;
  int remembered = 0;
  for (int64_t i = 0; i < 40; ++i) {
    tilt = std::max(tilt, angle_of_trunk(batch, i));
    const float* past = batch.past.data<float>() + i * kJoints * 4;
    if (past[3] == 0) continue;  // asked for, or without trust
    ++remembered;
    for (int j = 0; j < kJoints; ++j)
      far += (Vec3(past[4 * j], past[4 * j + 1], past[4 * j + 2]) - at(batch.joints, i, j)).norm() /
             kJoints;
  }
  ASSERT_GT(remembered, 5);
  EXPECT_GT(tilt, 0.5) << "somebody was tilted";
  EXPECT_LT(far / remembered, 0.25) << "a memory in another frame is half a metre off";
}

TEST(SamplingPartial, WhoIsTiltedIsShownUpright) {
  CloudConfig config{.points = 64, .tpose_share = 0, .bend = 60, .upright = 1};
  const CloudBatch upright = batch_of(config, 200);
  config.upright = 0;
  const CloudBatch as_it_is = batch_of(config, 200);
  int tilted = 0;
  for (int64_t i = 0; i < 200; ++i) {
    tilted += angle_of_trunk(as_it_is, i) > kTiltedTrunk;
    EXPECT_LE(angle_of_trunk(upright, i), kTiltedTrunk + 1e-6);
  }
  EXPECT_GT(tilted, 10);
}

TEST(SamplingPartial, CamerasAtTheCeilingSeeHeadsAndNoSoles) {
  const CloudConfig above{
      .points = 512, .noise = 0, .tpose_share = 0, .one_camera = 1, .ceiling = 1};
  const CloudBatch seen = batch_of(above);
  CloudConfig usual = above;
  usual.ceiling = 0;
  const CloudBatch before = batch_of(usual);
  double high = 0, low = 0;
  for (int64_t i = 0; i < 40; ++i) {
    high += at(seen.joints, i, kHead).y();
    low += at(before.joints, i, kHead).y();
  }
  EXPECT_LT(high, low) << "more points are near the head, so the centroid is higher";
}

}  // namespace
}  // namespace restage
