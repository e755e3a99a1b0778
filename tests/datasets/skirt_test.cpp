// Cloth around both legs.
#include "datasets/sampling/skirt.h"

#include <gtest/gtest.h>

#include <cmath>

#include "datasets/sampling/clouds.h"
#include "tests/datasets/sampling_support.h"

namespace restage {
namespace {

using namespace testing;

/// A leg that stands straight down: `reach` about its middle, from above the hips to the floor.
struct Stand {
  Stand() {
    joints = training_corpus().bodies[0].joints;
    for (const size_t leg : {0, 1}) {
      const double x = leg == 0 ? 0.1 : -0.1;
      joints[1 + leg] = {x, 0.9, 0};
      joints[4 + leg] = {x, 0.5, 0};
      joints[7 + leg] = {x, 0.1, 0};
    }
    Rng rng(RngKey{3, 0});
    for (int i = 0; i < 4000; ++i) {
      const double x = i % 2 == 0 ? 0.1 : -0.1, turn = rng.uniform(-M_PI, M_PI);
      points.push_back(Vec3(x + 0.08 * std::cos(turn), rng.uniform(0, 1.2), 0.08 * std::sin(turn))
                           .cast<float>());
    }
    normals.assign(points.size(), Point::UnitY());
    legs.assign(points.size(), true);
  }
  Joints joints;
  Points points, normals;
  std::vector<bool> legs;
};

double from_the_line_between(const Point& p) {
  return std::hypot(std::max(0.0, std::abs(double{p.x()}) - 0.1), double{p.z()});
}

TEST(Skirt, GoesRoundBothLegsFromTheWaistToItsHem) {
  const Stand before;
  for (const double hem : {0.6, 1.0, 1.7}) {
    Stand now = before;
    Rng rng(RngKey{1, 0});
    put_on({.hem = hem, .ease = 0.02, .flare = 0.1}, now.joints, now.legs, rng, now.points,
           now.normals);
    const double low = 0.9 - 0.4 * hem, high = 1.0;
    int left = 0, covered = 0, between = 0;
    for (size_t i = 0; i < now.points.size(); ++i) {
      const Point &p = now.points[i], &was = before.points[i];
      if (was.y() > high + 1e-3 || was.y() < low - 1e-3) {
        EXPECT_EQ(p, was);
        continue;
      }
      if (was.y() > high - 1e-3 || was.y() < low + 1e-3) continue;
      ++covered;
      EXPECT_NEAR(p.y(), was.y(), 1e-3);
      const double wide = 0.08 + 0.02 + 0.1 * ((0.9 - double{p.y()}) / 0.4 + 0.25);
      EXPECT_NEAR(from_the_line_between(p), wide, 2e-3);
      EXPECT_EQ(p.x() > 0, was.x() > 0) << "a leg's point on the other leg's side";
      EXPECT_NEAR(now.normals[i].norm(), 1, 1e-4);
      EXPECT_GT(now.normals[i].dot(Point(p.x() > 0 ? p.x() - 0.1f : p.x() + 0.1f, 0, p.z())),
                std::abs(p.x()) < 0.1f ? 0 : 0.9 * wide);
      left += p.x() > 0;
      between += std::abs(p.x()) < 0.05f;
    }
    EXPECT_GT(covered, 1000);
    EXPECT_NEAR(left, covered / 2, covered / 10);
    EXPECT_GT(between, covered / 20) << "the cloth is not taut between the legs";
  }
}

/// One shin is bent back: the cloth between the legs climbs, and is not torn.
TEST(Skirt, IsWholeWhereOneLegIsHigher) {
  Stand now;
  now.joints[8] = {-0.1, 0.5, -0.4};
  Rng rng(RngKey{1, 0});
  const Points before = now.points;
  put_on({.hem = 1.7, .ease = 0.02}, now.joints, now.legs, rng, now.points, now.normals);
  Points cloth;
  for (size_t i = 0; i < before.size(); ++i)
    if (now.points[i] != before[i]) cloth.push_back(now.points[i]);
  ASSERT_GT(cloth.size(), 500u);
  const auto lowest_at = [&](float x) {
    float out = 9;
    for (const Point& p : cloth)
      if (std::abs(p.x() - x) < 0.02f) out = std::min(out, p.y());
    return out;
  };
  for (float x = -0.15f; x < 0.14f; x += 0.02f)
    EXPECT_LT(std::abs(lowest_at(x) - lowest_at(x + 0.02f)), 0.12f) << "a step at " << x;
}

TEST(Skirt, LeavesAloneWhatIsNoLeg) {
  Stand now;
  now.legs.assign(now.points.size(), false);
  const Points before = now.points;
  Rng rng(RngKey{1, 0});
  put_on(draw_skirt(rng), now.joints, now.legs, rng, now.points, now.normals);
  EXPECT_EQ(now.points, before);
}

TEST(Skirt, StandsSomebodyWhoseLegsAreOnePoint) {
  Stand now;
  for (const size_t j : {1, 2, 4, 5, 7, 8}) now.joints[j] = {0, 0.5, 0};
  for (uint64_t k = 0; k < 20; ++k) {
    Rng rng(RngKey{k, 0});
    put_on(draw_skirt(rng), now.joints, now.legs, rng, now.points, now.normals);
    for (const Point& p : now.points) ASSERT_TRUE(p.allFinite());
  }
}

TEST(Skirt, OfACloudMovesLegsAndNothingElse) {
  CloudConfig config{.points = 400, .noise = 0, .tpose_share = 0.3};
  config.skin_weights = true;
  const CloudSampler bare(training_corpus(), config, 1);
  config.skirts = 1;
  const CloudSampler dressed(training_corpus(), config, 1);
  const CloudBatch a = bare.batch(0, 20), b = dressed.batch(0, 20);
  EXPECT_TRUE(same_bits(b.points, dressed.batch(0, 20).points));
  int moved = 0;
  for (int64_t i = 0; i < 20 * 400; ++i) {
    const auto world = [&](const CloudBatch& batch) {
      return Point(Eigen::Map<const Point>(batch.points.data<float>() + 3 * i) +
                   Eigen::Map<const Point>(batch.centres.data<float>() + 3 * (i / 400)));
    };
    const float* w = a.weights.data<float>() + i * kJoints;
    const bool leg = w[0] + w[1] + w[2] + w[4] + w[5] > 0.49f;
    const float by = (world(a) - world(b)).norm();
    if (!leg) {
      EXPECT_LT(by, 1e-5f);
    }
    moved += by > 0.01f;
    for (int j = 0; j < kJoints; ++j)
      EXPECT_EQ(w[j], b.weights.data<float>()[i * kJoints + j]) << "whose point it is";
  }
  EXPECT_GT(moved, 500);
}

}  // namespace
}  // namespace restage
