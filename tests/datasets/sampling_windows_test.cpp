// Windows for motion retargeting and pairs for deformation.
#include "datasets/sampling/windows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "autograd/base/error.h"
#include "datasets/sampling/pairs.h"
#include "tests/datasets/sampling_support.h"

namespace restage {
namespace {

using namespace testing;

Joints joints_at(const Tensor& x, int64_t row, int64_t frame = 0) {
  Joints out;
  for (int j = 0; j < kJoints; ++j) out[j] = at(x, row, frame * kJoints + j);
  return out;
}

/// Joints that 6D rotations give a rest skeleton.
Joints kinematics(const Tensor& rest, const Tensor& sixd, int64_t row, int64_t frame) {
  Pose pose;
  for (int j = 0; j < kJoints; ++j) {
    const Vec3 x = at(sixd, row, (frame * kJoints + j) * 2);
    const Vec3 y = at(sixd, row, (frame * kJoints + j) * 2 + 1);
    pose.local[j].col(0) = x;
    pose.local[j].col(1) = y;
    pose.local[j].col(2) = x.cross(y);
  }
  return forward_kinematics(joints_at(rest, row), pose).joints;
}

double largest(const Joints& a, const Joints& b) {
  double out = 0;
  for (int j = 0; j < kJoints; ++j) out = std::max(out, (a[j] - b[j]).norm());
  return out;
}

TEST(SamplingWindows, RotationsGiveTheJointsMirroredOrNot) {
  Corpus corpus = training_corpus();
  for (Body& body : corpus.bodies) body.joints[4].x() += 0.03;  // sides that differ
  const WindowSampler sampler(corpus, {.truth = true}, 1);
  const WindowBatch batch = sampler.batch(0, 12);
  int mirrored = 0;
  for (int64_t i = 0; i < 12; ++i) {
    mirrored += sampler.subject(i).augmentation.mirror;
    for (const int64_t t : {0, 13, 29}) {
      const Joints a = kinematics(batch.rest_a, batch.sixd_a, i, t);
      EXPECT_LT(largest(a, joints_at(batch.joints_a, i, t)), 1e-5);
      const Joints b = kinematics(batch.rest_b, batch.truth_sixd_b, i, t);
      EXPECT_LT(largest(b, joints_at(batch.truth_b, i, t)), 1e-5);
      EXPECT_EQ(at(batch.joints_a, i, t * kJoints).norm(), 0.0);
    }
  }
  EXPECT_GT(mirrored, 1);
  EXPECT_LT(mirrored, 11);
}

TEST(SamplingWindows, SelfSamplesHaveOneBody) {
  const WindowSampler sampler(training_corpus(), {.self_share = 0.4, .truth = true}, 2);
  const WindowBatch batch = sampler.batch(0, 60);
  for (int64_t i = 0; i < 60; ++i) {
    const WindowSubject s = sampler.subject(i);
    const bool self = batch.self_mask.item(i) == 1.0;
    EXPECT_EQ(self, s.self);
    EXPECT_EQ(self, s.body_a == s.body_b);
    EXPECT_EQ(self, same_bits(batch.rest_a.rows(i, i + 1), batch.rest_b.rows(i, i + 1)));
    EXPECT_EQ(self, same_bits(batch.joints_a.rows(i, i + 1), batch.truth_b.rows(i, i + 1)));
  }
  int selves = 0;
  std::set<std::pair<size_t, size_t>> couples;
  for (int64_t i = 0; i < 3000; ++i) {
    const WindowSubject s = sampler.subject(i);
    selves += s.self;
    couples.insert({s.body_a, s.body_b});
    // The motion of ten frames is too short.
    EXPECT_LE(s.clip.frame + 30, training_corpus().motions[s.clip.motion].frames());
    EXPECT_LE(s.real.frame + 30, training_corpus().motions[s.real.motion].frames());
  }
  EXPECT_NEAR(selves / 3000.0, 0.4, 5 * std::sqrt(0.24 / 3000));
  EXPECT_EQ(couples.size(), 9u);
}

TEST(SamplingWindows, TheDiscriminatorsWindowHasBsBones) {
  const WindowBatch batch = WindowSampler(training_corpus(), {}, 3).batch(0, 10);
  for (int64_t i = 0; i < 10; ++i) {
    const Joints rest = joints_at(batch.rest_b, i), real = joints_at(batch.real_b, i, 17);
    for (int j = 1; j < kJoints; ++j)
      EXPECT_NEAR((real[j] - real[kParents[j]]).norm(), (rest[j] - rest[kParents[j]]).norm(), 1e-5);
  }
}

TEST(SamplingWindows, TranslationsDescribeThePath) {
  WindowConfig config{.truth = true};
  std::vector<WindowBatch> batches;
  for (const auto kind : {Translation::velocity, Translation::relative, Translation::absolute}) {
    config.translation = kind;
    batches.push_back(WindowSampler(training_corpus(), config, 4).batch(0, 5));
  }
  for (int64_t i = 0; i < 5; ++i)
    for (int64_t t = 0; t < config.frames; ++t) {
      const Vec3 root = at(batches[0].root_a, i, t);
      const int64_t later = std::max<int64_t>(t, 1);
      const Vec3 step = at(batches[0].root_a, i, later) - at(batches[0].root_a, i, later - 1);
      EXPECT_LT((at(batches[0].trans_a, i, t) - 30 * step).norm(), 1e-4);
      EXPECT_LT((at(batches[1].trans_a, i, t) - (root - at(batches[1].root_a, i, 0))).norm(), 1e-5);
      EXPECT_LT((at(batches[2].trans_a, i, t) - root).norm(), 1e-6);
      EXPECT_GT(root.y(), 0.5);
    }
  EXPECT_TRUE(same_bits(batches[0].trans_a, batches[0].input_trans_a));
}

TEST(SamplingWindows, RemovedHeadingsFaceForwardAndKeepTheMotion) {
  WindowConfig config{.truth = true};
  const WindowBatch free = WindowSampler(training_corpus(), config, 4).batch(0, 6);
  config.remove_heading = true;
  const WindowBatch faced = WindowSampler(training_corpus(), config, 4).batch(0, 6);
  double turned = 0;
  for (int64_t i = 0; i < 6; ++i)
    for (int64_t t = 0; t < config.frames; ++t) {
      const Joints a = joints_at(faced.joints_a, i, t), before = joints_at(free.joints_a, i, t);
      EXPECT_NEAR(heading_angle(a), 0.0, 1e-4);
      EXPECT_NEAR(heading_angle(joints_at(faced.real_b, i, t)), 0.0, 1e-4);
      turned = std::max(turned, std::abs(heading_angle(before)));
      const Mat3 turn = Eigen::AngleAxisd(-heading_angle(before), Vec3::UnitY()).toRotationMatrix();
      EXPECT_LT((turn * at(free.trans_a, i, t) - at(faced.trans_a, i, t)).norm(), 1e-4);
      // B turns by A's heading, and rotations still give the joints.
      const Joints b = joints_at(faced.truth_b, i, t);
      EXPECT_LT((turn * joints_at(free.truth_b, i, t)[20] - b[20]).norm(), 1e-4);
      EXPECT_LT(largest(kinematics(faced.rest_a, faced.sixd_a, i, t), a), 1e-5);
      EXPECT_LT(largest(kinematics(faced.rest_b, faced.truth_sixd_b, i, t), b), 1e-5);
    }
  EXPECT_GT(turned, 1.0);
}

TEST(SamplingWindows, ASteadyHeadingIsLessRestless) {
  WindowConfig config{.noise = 0.03, .mirror = false, .remove_heading = true};
  double restless[2];
  for (const bool steady : {false, true}) {
    config.steady_heading = steady;
    const WindowBatch batch = WindowSampler(training_corpus(), config, 4).batch(0, 8);
    restless[steady] = 0;
    for (int64_t i = 0; i < 8; ++i)
      for (int64_t t = 2; t < config.frames; ++t) {
        const auto angle = [&](int64_t f) {
          return heading_angle(joints_at(batch.joints_a, i, f));
        };
        // Of what is true, turned by what was seen: its second differences are noise.
        restless[steady] +=
            std::abs(std::remainder(angle(t) - 2 * angle(t - 1) + angle(t - 2), 2 * M_PI));
      }
  }
  EXPECT_LT(restless[true], 0.5 * restless[false]);
}

TEST(SamplingWindows, NoiseIsOnTheInputOnly) {
  const WindowBatch clean = WindowSampler(training_corpus(), {}, 4).batch(0, 20);
  EXPECT_TRUE(same_bits(clean.input_a, clean.joints_a));
  const WindowConfig config{.noise = 0.02, .noise_correlation = 0.6, .noisy_translation = true};
  const WindowBatch noisy = WindowSampler(training_corpus(), config, 4).batch(0, 20);
  EXPECT_TRUE(same_bits(clean.joints_a, noisy.joints_a));
  EXPECT_TRUE(same_bits(clean.trans_a, noisy.trans_a));
  EXPECT_FALSE(same_bits(noisy.trans_a, noisy.input_trans_a));
  double square = 0, lagged = 0;
  int n = 0;
  for (int64_t i = 0; i < 20; ++i)
    for (int64_t t = 1; t < 30; ++t)
      for (int j = 0; j < kJoints; ++j) {
        const auto noise = [&](int64_t frame) {
          const int64_t k = frame * kJoints + j;
          return Vec3(at(noisy.input_a, i, k) - at(noisy.joints_a, i, k));
        };
        if (j == 0) {
          EXPECT_EQ(noise(t).norm(), 0.0);
          continue;
        }
        square += noise(t).squaredNorm();
        lagged += noise(t).dot(noise(t - 1));
        n += 3;
      }
  // The pelvis' own noise adds to every other joint's.
  EXPECT_NEAR(std::sqrt(square / n), 0.02 * std::sqrt(2.0), 0.003);
  EXPECT_NEAR(lagged / square, 0.6, 0.1);
}

TEST(SamplingWindows, SettingsOutOfRangeAreErrors) {
  for (const WindowConfig& bad :
       {WindowConfig{.frames = 1}, WindowConfig{.frames = 1000}, WindowConfig{.self_share = 2}})
    EXPECT_THROW(WindowSampler(training_corpus(), bad, 1), InputError);
  Corpus lonely = training_corpus();
  lonely.bodies.resize(1);
  EXPECT_THROW(WindowSampler(lonely, {}, 1), InputError);
  EXPECT_EQ(WindowSampler(lonely, {.self_share = 1}, 1).batch(0, 2).self_mask.item(1), 1.0);
}

TEST(SamplingPairs, TheRestPoseGivesTheRestPoints) {
  const PairSampler sampler(training_corpus(), {200, false, false}, 1);
  Pose rest;
  rest.local.fill(Mat3::Identity());
  rest.root = Vec3(3, 1, -2);
  const PairBatch pair = sampler.pair(4, 1, rest);
  EXPECT_EQ(pair.rest_points.shape(), (Shape{1, 200, 3}));
  for (int i = 0; i < 200; ++i)
    EXPECT_LT((at(pair.rest_points, 0, i) - at(pair.posed_points, 0, i)).norm(), 2e-6);
  EXPECT_EQ(at(pair.rest_joints, 0, 0).norm(), 0.0);
  for (int j = 0; j < kJoints; ++j) EXPECT_LT(at(pair.axis_angle, 0, j).norm(), 1e-6);
}

TEST(SamplingPairs, PointsCorrespondThroughTheBones) {
  // Bodies of rigid boxes: all corners of a box follow one joint, and no muscle swells. Then
  // G (p - rest_j) + P_j takes every point from rest to its pose, j the joint of its box.
  Corpus corpus = training_corpus();
  for (Body& body : corpus.bodies) {
    auto none = std::make_shared<PoseBlendShapes>();
    none->directions.setZero(3 * body.weights.rows(), PoseBlendShapes::kFeatures);
    body.blend_shapes = none;
    body.joints[4].x() += 0.03;  // sides that differ
    for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
      body.weights.row(v).setZero();
      body.weights(v, kParents[static_cast<size_t>(v / 8 + 1)]) = 1.0f;
    }
  }
  const PairSampler sampler(
      corpus, {.points = 150, .heading = true, .mirror = true, .skin_weights = true}, 7);
  const PairBatch batch = sampler.batch(0, 6);
  for (int64_t i = 0; i < 6; ++i) {
    Pose pose;
    for (int j = 0; j < kJoints; ++j)
      for (int r = 0; r < 3; ++r) pose.local[j].row(r) = at(batch.local, i, 3 * j + r);
    const Joints rest = joints_at(batch.rest_joints, i);
    const PosedSkeleton posed = forward_kinematics(rest, pose);
    for (int j = 0; j < kJoints; ++j) {
      const Vec3 v = at(batch.axis_angle, i, j);
      const Mat3 r = Eigen::AngleAxisd(v.norm(), v.stableNormalized()).toRotationMatrix();
      EXPECT_LT((r - pose.local[j]).norm(), 1e-5);
      EXPECT_LE(v.norm(), 3.14160);
    }
    for (int k = 0; k < 150; ++k) {
      const float* weights = batch.weights.data<float>() + (i * 150 + k) * kJoints;
      const auto j = std::max_element(weights, weights + kJoints) - weights;
      EXPECT_EQ(weights[j], 1) << "point " << k;
      const Vec3 moved =
          posed.global[j] * (at(batch.rest_points, i, k) - rest[j]) + posed.joints[j];
      EXPECT_LT((moved - at(batch.posed_points, i, k)).norm(), 1e-5) << "pair " << i << ", " << k;
    }
  }
}

TEST(SamplingPairs, RandomPairsMoveAndSettingsAreChecked) {
  const PairBatch batch = PairSampler(training_corpus(), {50, true, false}, 1).batch(0, 3);
  double moved = 0;
  for (int64_t i = 0; i < 3; ++i)
    for (int k = 0; k < 50; ++k)
      moved += (at(batch.rest_points, i, k) - at(batch.posed_points, i, k)).norm() / 150;
  EXPECT_GT(moved, 0.05);
  EXPECT_THROW(PairSampler(training_corpus(), {0, true, false}, 1), InputError);
  EXPECT_THROW(PairSampler(Corpus{}, {}, 1), InputError);
}

}  // namespace
}  // namespace restage
