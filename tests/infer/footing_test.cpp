// Soles stand on the floor, whatever legs and boots a figure has.
#include "infer/footing.h"

#include <gtest/gtest.h>

#include "infer/foot_lock.h"
#include "nn/geometry/contact.h"
#include "tests/infer/toy_body.h"

namespace restage {
namespace {

using testing::toy_body;

Pose at_rest(const Joints& rest) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = rest[kPelvis];
  return pose;
}

Soles soles_of(const Body& body) { return Soles(body.rest, body.joints, body.weights); }

double lowest_vertex(const Body& body, const Pose& pose) {
  double out = 1e9;
  for (const Point& p : pose_surface(body, pose)) out = std::min(out, static_cast<double>(p.y()));
  return out;
}

TEST(Footing, SolesAreTheLowestPointsOfTheFeet) {
  const Body body = toy_body();
  const Soles soles = soles_of(body);
  Pose pose = at_rest(body.joints);
  pose.root.y() += 0.1;
  const auto height = soles.lowest(forward_kinematics(body.joints, pose));
  EXPECT_NEAR(std::min(height[0], height[1]), 0.1, 0.01);
  EXPECT_NEAR(Soles(body.joints).lowest(forward_kinematics(body.joints, pose))[0], 0.1, 1e-9);
}

TEST(Footing, AFootNearTheFloorIsOnItAndAStepCounts) {
  Joints a = toy_body().joints;
  const FlatFoot flat = flat_foot(a);
  EXPECT_EQ(sole_heights(a, flat, 1.5), (std::array<double, 2>{0, 0}));
  for (Vec3& x : a) x.y() += 0.03;  // boots
  EXPECT_EQ(sole_heights(a, flat, 1.5), (std::array<double, 2>{0, 0}));
  for (Vec3& x : a) x.y() += 0.27;  // a step
  for (const double height : sole_heights(a, flat, 1.5)) EXPECT_NEAR(height, 0.45, 1e-9);
  for (const double height : least_heights(a, flat, 1.5)) EXPECT_EQ(height, 0);
  for (Vec3& x : a) x.y() -= 0.6;  // a step down
  for (const double height : least_heights(a, flat, 1.5)) EXPECT_NEAR(height, -0.45, 1e-9);
}

TEST(Footing, AFigureStandsAtOnceAndSettlesSmoothly) {
  const Body body = toy_body();
  const Joints a = body.joints;
  Footing footing(soles_of(body));
  Pose pose = at_rest(body.joints);
  pose.root.y() += 0.12;  // as of a boot that the source lacks
  footing(body.joints, a, 1, {0.9, 0.9}, &pose);
  EXPECT_NEAR(lowest_vertex(body, pose), 0, 0.01) << "in the first frame";
  double before = pose.root.y();
  for (int f = 0; f < 30; ++f) {  // the legs' estimate has changed
    pose = at_rest(body.joints);
    pose.root.y() += 0.16;
    footing(body.joints, a, 1, {0.9, 0.9}, &pose);
    EXPECT_LT(std::abs(pose.root.y() - before), f == 0 ? 0.05 : 0.02) << f;
    before = pose.root.y();
  }
  EXPECT_NEAR(lowest_vertex(body, pose), 0, 0.01);
  Joints flying = a;
  for (Vec3& x : flying) x.y() += 0.4;
  pose = at_rest(body.joints);
  pose.root.y() += 0.16 + 0.4;
  footing(body.joints, flying, 1, {0.1, 0.1}, &pose);
  EXPECT_NEAR(lowest_vertex(body, pose), 0.4, 0.02) << "a jump stays a jump";
  footing.forget();
  pose = at_rest(body.joints);
  pose.root.y() -= 0.3;
  footing(body.joints, a, 1, {0.1, 0.1}, &pose);
  EXPECT_NEAR(lowest_vertex(body, pose), 0, 0.01) << "another sequence, of which nothing is known";
}

TEST(Footing, NoFootGoesBelowTheFloor) {
  const Body body = toy_body();
  const Soles soles = soles_of(body);
  Pose pose = at_rest(body.joints);
  pose.root.y() -= 0.1;
  const PosedSkeleton before = forward_kinematics(body.joints, pose);
  raise_feet(depths({0, -1}, soles, body.joints, pose), body.joints, &pose);
  const PosedSkeleton after = forward_kinematics(body.joints, pose);
  EXPECT_NEAR(soles.lowest(after)[0], 0, 0.01);
  EXPECT_NEAR(soles.lowest(after)[1], soles.lowest(before)[1], 0.005) << "its floor is lower";
  EXPECT_LT((after.global[7] - before.global[7]).norm(), 1e-9) << "the ankle's turn stays";
  EXPECT_LT((after.joints[15] - before.joints[15]).norm(), 1e-9);
}

TEST(Footing, AFootThatFloatsIsLetDownWhileTheSourcesIsNearTheFloor) {
  const Body body = toy_body();
  const Soles soles = soles_of(body);
  Joints a = body.joints;
  const auto shown = [&](Footing& footing) {
    Pose pose = at_rest(body.joints);
    pose.local[2] = Eigen::AngleAxisd(-0.45, Vec3::UnitX()).toRotationMatrix();
    pose.local[5] = Eigen::AngleAxisd(0.9, Vec3::UnitX()).toRotationMatrix();
    const PosedSkeleton before = forward_kinematics(body.joints, pose);
    footing.settle_feet(body.joints, a, 1, &pose);
    const PosedSkeleton after = forward_kinematics(body.joints, pose);
    EXPECT_LT((after.global[8] - before.global[8]).norm(), 1e-9) << "the ankle's turn stays";
    return std::pair(soles.lowest(before), soles.lowest(after));
  };
  Footing footing(soles);
  double height = 1;
  for (int f = 0; f < 12; ++f) {
    const auto [before, after] = shown(footing);
    EXPECT_GT(before[1], 0.05);
    EXPECT_LE(after[1], height + 1e-9) << f;
    EXPECT_NEAR(after[0], before[0], 0.001) << "the other foot is on the floor";
    height = after[1];
  }
  EXPECT_LT(height, 0.025);
  for (const int j : {8, 11}) a[static_cast<size_t>(j)].y() += 0.3;  // a kick
  Footing kicks(soles);
  const auto [before, after] = shown(kicks);
  EXPECT_NEAR(after[1], before[1], 1e-9);
}

TEST(Footing, AHeldFootIsHeldOnTheFloor) {
  const Body body = toy_body();
  const Soles soles = soles_of(body);
  Footing footing(soles);
  FootLock lock;
  Joints a = body.joints;
  for (int f = 0; f < 40; ++f) {
    Pose pose = at_rest(body.joints);
    pose.local[1] = Eigen::AngleAxisd(-0.25, Vec3::UnitX()).toRotationMatrix();
    pose.local[4] = Eigen::AngleAxisd(0.5, Vec3::UnitX()).toRotationMatrix();  // one leg is short
    pose.root.x() += 0.002 * f;
    const auto above = footing(body.joints, a, 1, {0.9, 0.9}, &pose);
    lock(body.joints, {0.9, 0.9}, &pose, above);
    footing.settle_feet(body.joints, a, 1, &pose);
    if (f < 20) continue;
    for (const double height : soles.lowest(forward_kinematics(body.joints, pose)))
      EXPECT_NEAR(height, 0, 0.015) << f;
  }
}

}  // namespace
}  // namespace restage
