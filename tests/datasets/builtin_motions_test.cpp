// The built-in motions: plausible, smooth, on the floor, varied, split by subject.
#include "datasets/builtin/motions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/pose_channels.h"

namespace restage {
namespace {

const std::vector<Motion>& some_motions() {
  static const std::vector<Motion> motions = builtin_motions(21, 66, 22, 22);
  return motions;
}

Joints joints_of(const Motion& m, size_t frame) {
  Joints x;
  x[0] = Vec3::Zero();
  for (int j = 1; j < kJoints; ++j)
    x[j] = x[kParents[j]] +
           m.global[frame][kParents[j]].cast<double>() * (m.rest[j] - m.rest[kParents[j]]);
  const Vec3 shift = m.hips[frame].cast<double>() - 0.5 * (x[1] + x[2]);
  for (Vec3& p : x) p += shift;
  return x;
}

TEST(BuiltinMotions, AreFiniteUnitAndOfTheRightLength) {
  for (const Motion& m : some_motions()) {
    EXPECT_GE(m.frames(), 60u) << m.id;
    EXPECT_LE(m.frames(), 180u) << m.id;
    ASSERT_EQ(m.hips.size(), m.frames());
    for (size_t f = 0; f < m.frames(); ++f) {
      ASSERT_TRUE(m.hips[f].allFinite());
      for (const auto& q : m.global[f]) ASSERT_NEAR(q.norm(), 1, 1e-5);
    }
  }
}

TEST(BuiltinMotions, MoveAtHumanSpeed) {
  for (const Motion& m : some_motions()) {
    Joints before = joints_of(m, 0);
    for (size_t f = 1; f < m.frames(); ++f) {
      EXPECT_LT((m.hips[f] - m.hips[f - 1]).norm() * kFps, 6.5) << m.id << " frame " << f;
      const Joints now = joints_of(m, f);
      for (int j = 0; j < kJoints; ++j) {
        EXPECT_LT((now[j] - before[j]).norm() * kFps, 14)
            << m.id << " frame " << f << " joint " << j;
        const double turn = m.global[f][j].angularDistance(m.global[f - 1][j]);
        EXPECT_LT(turn, 0.9) << m.id << " frame " << f << " joint " << j;
      }
      before = now;
    }
  }
}

TEST(BuiltinMotions, StandOnTheFloor) {
  for (const Motion& m : some_motions()) {
    double worst = 0, highest = 0;
    for (size_t f = 0; f < m.frames(); ++f) {
      const Joints x = joints_of(m, f);
      double lowest = 1e9;
      for (const int j : {7, 8, 10, 11}) lowest = std::min(lowest, x[j].y() - m.rest[j].y());
      worst = std::min(worst, lowest);
      highest = std::max(highest, lowest);
    }
    EXPECT_GT(worst, -0.05) << m.id;
    const bool flies = m.action == "jog" || m.action == "jump" || m.action == "dance";
    EXPECT_LT(highest, flies ? 0.6 : 0.12) << m.id;
    if (m.action == "jump") {
      EXPECT_GT(highest, 0.08) << m.id;
    }
  }
}

TEST(BuiltinMotions, StandingFeetHardlySlide) {
  for (const Motion& m : some_motions()) {
    if (m.action == "jump" || m.action == "jog" || m.action == "dance") continue;
    std::vector<double> speed;
    Joints before = joints_of(m, 0);
    for (size_t f = 1; f < m.frames(); ++f) {
      const Joints now = joints_of(m, f);
      double slowest = 1e9;
      for (const int j : {7, 8, 10, 11})
        slowest = std::min(slowest, (now[j] - before[j]).cwiseProduct(Vec3(1, 0, 1)).norm() * kFps);
      speed.push_back(slowest);
      before = now;
    }
    std::sort(speed.begin(), speed.end());
    EXPECT_LT(speed[speed.size() / 2], 0.3) << m.id;
  }
}

TEST(BuiltinMotions, SplitsShareNoSubjectAndHaveEveryAction) {
  std::map<std::string, std::string> split_of;
  std::map<std::string, std::set<std::string>> actions;
  std::set<std::string> ids;
  for (const Motion& m : some_motions()) {
    const auto [it, fresh] = split_of.emplace(m.subject, m.split);
    EXPECT_EQ(it->second, m.split) << m.subject;
    actions[m.split].insert(m.action);
    ids.insert(m.id);
  }
  EXPECT_EQ(ids.size(), some_motions().size());
  for (const char* split : {"train", "validation", "test"})
    EXPECT_EQ(actions[split].size(), builtin_actions().size()) << split;
}

TEST(BuiltinMotions, AreFunctionsOfSeedSplitAndNumber) {
  const Motion again = builtin_motion(21, "validation", 4);
  const Motion& first = some_motions()[66 + 4];
  ASSERT_EQ(first.id, again.id);
  ASSERT_EQ(first.frames(), again.frames());
  EXPECT_EQ(first.hips, again.hips);
  for (size_t f = 0; f < first.frames(); ++f)
    for (int j = 0; j < kJoints; ++j)
      ASSERT_EQ(first.global[f][j].coeffs(), again.global[f][j].coeffs());
  EXPECT_NE(builtin_motion(22, "validation", 4).hips, first.hips);
  EXPECT_NE(builtin_motion(21, "test", 4).hips, first.hips);
  // The same action by the same maker is never the same performance.
  EXPECT_EQ(some_motions()[0].action, some_motions()[22].action);
  EXPECT_NE(some_motions()[0].hips, some_motions()[22].hips);
}

// A network must see raised, crossed and bent arms, deep knees, twisted trunks and all headings.
TEST(BuiltinMotions, CoverThePoseSpace) {
  int raised = 0, crossed = 0, elbow = 0, knee = 0, bent = 0, twisted = 0;
  std::array<int, 8> heading{};
  for (const Motion& m : some_motions())
    for (size_t f = 0; f < m.frames(); f += 3) {
      const Joints x = joints_of(m, f);
      const auto axis = [&](int j, const Vec3& v) {
        return Vec3(m.global[f][j].cast<double>() * v);
      };
      const Vec3 left = axis(9, Vec3::UnitX());
      raised += x[20].y() > x[15].y() || x[21].y() > x[15].y();
      crossed += (x[20] - x[9]).dot(left) < -0.05 || (x[21] - x[9]).dot(left) > 0.05;
      elbow += (x[18] - x[16]).normalized().dot((x[20] - x[18]).normalized()) < 0.2;
      knee += (x[4] - x[1]).normalized().dot((x[7] - x[4]).normalized()) < 0.2;
      bent += (x[12] - x[0]).normalized().y() < 0.75;
      twisted += axis(9, Vec3::UnitZ()).dot(axis(0, Vec3::UnitZ())) < 0.85;
      const Vec3 front = axis(0, Vec3::UnitZ());
      const double turn = std::atan2(front.x(), front.z()) / (2 * 3.14159265358979323846) + 0.5;
      ++heading[static_cast<size_t>(turn * 8) % 8];
    }
  for (const int count : {raised, crossed, elbow, knee, bent, twisted}) EXPECT_GT(count, 60);
  for (const int count : heading) EXPECT_GT(count, 100);
}

TEST(BuiltinMotions, RestIsATPoseOfTheAverageBody) {
  const Joints rest = builtin_rest_joints();
  EXPECT_EQ(some_motions()[0].rest, rest);
  EXPECT_NEAR(leg_length(rest), 0.8, 0.08);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((rest[kMirror[j]].cwiseProduct(Vec3(-1, 1, 1)) - rest[j]).norm(), 1e-12);
}

TEST(BuiltinMotions, RefuseBadRequests) {
  EXPECT_THROW(builtin_motion(1, "", 0), InputError);
  EXPECT_THROW(builtin_motion(1, "test", -2), InputError);
  EXPECT_THROW(builtin_motions(1, 0, -1, 0), InputError);
}

TEST(BuiltinPoseChannels, ZeroIsTheTPoseAndMirrorsAgree) {
  for (const Mat3& r : channel_rotations(Angles{})) EXPECT_LT((r - Mat3::Identity()).norm(), 1e-12);
  Angles a = neutral_angles();
  for (int c = 0; c < kChannels; ++c) a[c] += 7 * std::sin(1.3 * c);
  const Rotations r = channel_rotations(a), m = channel_rotations(mirrored(a));
  const Mat3 flip = Vec3(-1, 1, 1).asDiagonal();
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((m[kMirror[j]] - flip * r[j] * flip).norm(), 1e-9) << j;
}

TEST(BuiltinPoseChannels, SignsMeanWhatTheHeaderSays) {
  const Joints rest = builtin_rest_joints();
  const auto pose = [&](int which, double degrees) {
    Angles a{};
    a[which] = degrees;
    return forward_kinematics(rest, {channel_rotations(a), rest[0]}).joints;
  };
  EXPECT_GT(pose(channel(0, kElbow), 90)[20].z(), rest[20].z() + 0.2);     // forearm forward
  EXPECT_LT(pose(channel(1, kArmSide), -80)[21].y(), rest[21].y() - 0.4);  // arm down
  EXPECT_GT(pose(channel(1, kHipFlex), 60)[5].z(), rest[5].z() + 0.2);     // thigh forward
  EXPECT_LT(pose(channel(0, kKnee), 60)[7].z(), rest[7].z() - 0.2);        // shank back
  EXPECT_GT(pose(channel(0, kHipSide), 30)[7].x(), rest[7].x() + 0.2);
  EXPECT_LT(pose(channel(1, kHipSide), 30)[8].x(), rest[8].x() - 0.2);
  EXPECT_GT(pose(channel(0, kAnkle), 20)[10].y(), rest[10].y());
  EXPECT_GT(pose(kSpineBend, 40)[15].z(), rest[15].z() + 0.1);
}

TEST(BuiltinPoseChannels, LimitsKeepAnglesInRangeAndLeaveOrdinaryOnes) {
  Angles wild = neutral_angles();
  for (double& x : wild) x += 500;
  const Angles high = limit(wild);
  EXPECT_LE(high[channel(0, kElbow)], 145);
  EXPECT_LE(high[channel(1, kKnee)], 145);
  EXPECT_LE(high[kNeckTurn], 80);
  Angles mild{};
  mild[kSpineBend] = 30;
  mild[channel(0, kKnee)] = 60;
  EXPECT_EQ(limit(mild)[kSpineBend], 30);
  EXPECT_EQ(limit(mild)[channel(0, kKnee)], 60);
}

}  // namespace
}  // namespace restage
