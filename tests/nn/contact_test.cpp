// Feet that stand, legs that reach, and how both are measured.
#include "nn/geometry/contact.h"

#include <gtest/gtest.h>

#include <optional>

#include "infer/foot_lock.h"
#include "nn/metrics/metrics.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_joints;

/// Stands with bent knees for ten frames, then walks on the spot: the left foot up and down.
std::vector<Joints> stands_then_lifts() {
  std::vector<Joints> out;
  for (int t = 0; t < 20; ++t) {
    Joints joints = tiny_joints();
    if (t >= 10)
      for (const int j : {4, 7, 10}) joints[j].y() += 0.02 * (t - 9);
    out.push_back(joints);
  }
  return out;
}

Pose crouching() {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = Vec3(0.3, 0.8, -0.2);
  for (const int side : {0, 1}) {
    const auto about_x = [](double angle) {
      return Eigen::AngleAxisd(angle, Vec3::UnitX()).toRotationMatrix();
    };
    pose.local[1 + side] = about_x(-0.6);
    pose.local[4 + side] = about_x(1.1);
    pose.local[7 + side] = about_x(-0.4);
  }
  return pose;
}

TEST(Contact, StillFeetNearTheFloorStand) {
  const auto feet = standing_feet(stands_then_lifts());
  for (size_t t = 0; t < 20; ++t) {
    EXPECT_EQ(feet[t][0], t < 9) << t;
    EXPECT_TRUE(feet[t][1]) << t;
  }
  std::vector<Joints> held = stands_then_lifts();
  for (Joints& joints : held) joints[10].y() = 0.5;  // still, but high up
  EXPECT_FALSE(standing_feet(held)[5][0]);
}

TEST(Contact, LegsReachAndFeetKeepTheirOrientation) {
  const Joints rest = tiny_joints();
  const PosedSkeleton before = forward_kinematics(rest, crouching());
  for (const int side : {0, 1})
    for (const Vec3& offset : {Vec3(0.03, 0, 0.04), Vec3(-0.02, 0.05, 0), Vec3(0, -0.03, -0.05)}) {
      Pose pose = crouching();
      move_foot(rest, side, offset, &pose);
      const PosedSkeleton after = forward_kinematics(rest, pose);
      for (int j = 0; j < kJoints; ++j) {
        const bool foot = j == 7 + side || j == 10 + side;
        if (j == 4 + side) continue;
        EXPECT_LT((after.joints[j] - before.joints[j] - (foot ? offset : Vec3(0, 0, 0))).norm(),
                  1e-9)
            << j;
        if (foot) {
          EXPECT_LT((after.global[j] - before.global[j]).norm(), 1e-9);
        }
      }
      EXPECT_GT(after.joints[4 + side].z(), after.joints[7 + side].z()) << "knees bend forward";
    }
}

/// A wrist goes round the shoulder, past the direction in which the elbow lies.
TEST(Contact, ElbowsGoRoundWithTheArm) {
  const Joints rest = tiny_joints();
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = rest[kPelvis];
  pose.local[kLeftElbow] = Eigen::AngleAxisd(-1.5, Vec3::UnitY()).toRotationMatrix();
  const Joints begun = forward_kinematics(rest, pose).joints;
  const Vec3 arm = begun[kLeftWrist] - begun[kLeftShoulder];
  std::optional<Vec3> before;
  for (double angle = 0; angle < 1.8; angle += 0.02) {
    Pose moved = pose;
    move_hand(rest, 0, Eigen::AngleAxisd(angle, Vec3::UnitY()) * arm - arm, &moved);
    const Joints now = forward_kinematics(rest, moved).joints;
    EXPECT_NEAR((now[kLeftWrist] - begun[kLeftShoulder]).norm(), arm.norm(), 1e-6);
    if (before) {
      EXPECT_LT((now[kLeftElbow] - *before).norm(), 0.03 * arm.norm()) << angle;
    }
    before = now[kLeftElbow];
  }
}

TEST(Contact, ElbowsAreTurnedAboutTheArm) {
  const Joints rest = tiny_joints();
  for (const int side : {0, 1}) {
    const auto elbow = static_cast<size_t>(kLeftElbow + side),
               wrist = static_cast<size_t>(kLeftWrist + side),
               shoulder = static_cast<size_t>(kLeftShoulder + side);
    Pose pose = crouching();
    const Mat3 bent = Eigen::AngleAxisd(side == 0 ? -1.0 : 1.0, Vec3::UnitY()).toRotationMatrix();
    pose.local[elbow] = bent;
    const PosedSkeleton before = forward_kinematics(rest, pose);
    const Vec3 from = before.joints[shoulder], line = (before.joints[wrist] - from).normalized();
    const Vec3 place = from + Eigen::AngleAxisd(0.7, line) * (before.joints[elbow] - from);
    const Vec3 off_the_circle = place + 0.3 * line;
    for (const Vec3& wanted : {place, off_the_circle}) {
      Pose turned = pose;
      turn_elbow(rest, side, wanted, &turned);
      const PosedSkeleton after = forward_kinematics(rest, turned);
      EXPECT_LT((after.joints[elbow] - place).norm(), 1e-9);
      EXPECT_LT((after.joints[wrist] - before.joints[wrist]).norm(), 1e-9);
      EXPECT_LT((after.global[wrist] - before.global[wrist]).norm(), 1e-9);
    }
    Joints stretched = rest;
    stretched[elbow] = 0.5 * (rest[shoulder] + rest[wrist]) + Vec3(0, 1e-4, 0);
    Pose straight = crouching();
    const Mat3 held = straight.local[shoulder];
    turn_elbow(stretched, side, from + Vec3(0, 0, 1), &straight);
    EXPECT_LT((straight.local[shoulder] - held).norm(), 1e-2) << "a straight arm is not wrung";
  }
}

TEST(Contact, FartherThanALegNobodyReaches) {
  const Joints rest = tiny_joints();
  Pose pose = crouching();
  move_foot(rest, 0, Vec3(0, -5, 0), &pose);
  const Joints joints = forward_kinematics(rest, pose).joints;
  const double leg = (rest[4] - rest[1]).norm() + (rest[7] - rest[4]).norm();
  EXPECT_NEAR((joints[7] - joints[1]).norm(), leg, 1e-3);
  Pose straight;  // knees that are not bent say nothing of where they point
  straight.local.fill(Mat3::Identity());
  straight.root = rest[0];
  move_foot(rest, 1, Vec3(0, 0.1, 0), &straight);
  EXPECT_NEAR(forward_kinematics(rest, straight).joints[8].y(), rest[8].y() + 0.1, 1e-6);
  EXPECT_GT(forward_kinematics(rest, straight).joints[5].z(), rest[5].z() + 0.05);
}

TEST(Contact, LockedFeetStayAndLetGo) {
  const Joints rest = tiny_joints();
  FootLock lock;
  Joints shown = {}, said = {};
  double slid = 0, farthest = 0;
  for (int t = 0; t < 40; ++t) {
    Pose pose = crouching();
    pose.root.x() += 0.001 * t + 0.002 * (t % 2);  // creeps and trembles
    said = forward_kinematics(rest, pose).joints;
    lock(rest, {t < 20 ? 0.9 : 0.1, 0.0}, &pose);
    const Joints now = forward_kinematics(rest, pose).joints;
    if (t > 0 && t < 20) slid = std::max(slid, (now[10] - shown[10]).norm());
    if (t < 20) farthest = std::max(farthest, (now[10] - said[10]).norm());
    EXPECT_LT((now[0] - said[0]).norm(), 1e-12) << "the pelvis keeps its path";
    EXPECT_LT((now[11] - said[11]).norm(), 1e-12) << "the other foot is free";
    shown = now;
  }
  EXPECT_LT(slid, 0.0005);
  EXPECT_GT(farthest, 0.01);
  EXPECT_LT((shown[10] - said[10]).norm(), 1e-3) << "lifted";
}

TEST(Contact, FeetThatAreFarFromTheirPlaceAreLetGo) {
  const Joints rest = tiny_joints();
  FootLock lock;
  for (int t = 0; t < 30; ++t) {
    Pose pose = crouching();
    pose.root.z() += 0.01 * t;
    const Joints said = forward_kinematics(rest, pose).joints;
    lock(rest, {0.9, 0.9}, &pose);
    const Joints now = forward_kinematics(rest, pose).joints;
    for (const int foot : kFeet) EXPECT_LT((now[foot] - said[foot]).norm(), 0.07) << t;
  }
}

TEST(Contact, SharpMotionsHaveTheirPeaks) {
  std::vector<double> clap, smooth;
  for (int t = 0; t < 40; ++t)
    for (int axis = 0; axis < 3; ++axis) {
      clap.push_back(t >= 20 && t < 24 ? 0.1 * (t - 20) : 0);
      smooth.push_back(0.5 * clap.back());
    }
  const metrics::Track truth{clap.data(), 40, 1}, half{smooth.data(), 40, 1};
  EXPECT_NEAR(*metrics::peak_speed_ratio(truth, truth), 1, 1e-12);
  EXPECT_NEAR(*metrics::peak_speed_ratio(half, truth), 0.5, 1e-12);
  const std::vector<double> still(120, 1.0);
  EXPECT_FALSE(metrics::peak_speed_ratio(truth, {still.data(), 40, 1}));
}

TEST(Contact, SlidesAndDepthsAreMeasured) {
  std::vector<double> truth, slides, sinks;
  for (const Joints& joints : stands_then_lifts()) {
    const double t = static_cast<double>(truth.size()) / (3 * kJoints);
    for (const Vec3& x : joints) {
      truth.insert(truth.end(), {x.x(), x.y(), x.z()});
      slides.insert(slides.end(), {x.x() + 0.003 * t, x.y(), x.z()});
      sinks.insert(sinks.end(), {x.x(), x.y() - (t < 3 ? 0.05 : 0.004), x.z()});
    }
  }
  const auto track = [](const std::vector<double>& x) {
    return metrics::Track{x.data(), std::ssize(x) / (3 * kJoints), kJoints};
  };
  EXPECT_NEAR(*metrics::foot_slide_mm(track(slides), track(truth)), 3, 1e-9);
  EXPECT_NEAR(*metrics::foot_slide_mm(track(truth), track(truth)), 0, 1e-9);
  EXPECT_NEAR(*metrics::floor_penetration_mm(track(truth), track(truth)), 0, 1e-9);
  EXPECT_NEAR(*metrics::floor_penetration_mm(track(sinks), track(truth)), 50, 1e-9);
  EXPECT_FALSE(metrics::foot_slide_mm({truth.data(), 20, 11}, {truth.data(), 20, 11}));
  EXPECT_FALSE(metrics::foot_slide_mm(track(truth), {}));
}

}  // namespace
}  // namespace restage
