// Hands touch what the source's hands touch, whatever the figures' proportions are.
#include "infer/contacts.h"

#include <gtest/gtest.h>

#include "datasets/builtin/bodies.h"

namespace restage {
namespace {

const Body& person() {
  static const Body body = builtin_average_body();
  return body;
}

PartSurfaces surfaces_of(const Body& body) { return {body.rest, body.joints, body.weights}; }

Pose standing(const Body& body) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = body.joints[kPelvis];
  return pose;
}

Mat3 turn(double degrees, const Vec3& axis) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, axis).toRotationMatrix();
}

/// The left upper arm hangs down by `down` degrees, the forearm is bent before the trunk.
Pose with_left_arm(const Body& body, double down, double bent) {
  Pose pose = standing(body);
  pose.local[kLeftShoulder] = turn(-down, Vec3::UnitZ()) * turn(50, Vec3::UnitX());
  pose.local[kLeftElbow] = turn(-bent, Vec3::UnitY());
  return pose;
}

/// Both forearms in front, the hands towards each other.
Pose clapping(const Body& body, double bent) {
  Pose pose = standing(body);
  for (const int side : {0, 1}) {
    const double sign = side == 0 ? 1 : -1;
    pose.local[static_cast<size_t>(kLeftShoulder + side)] = turn(-sign * 80, Vec3::UnitY());
    pose.local[static_cast<size_t>(kLeftElbow + side)] = turn(-sign * bent, Vec3::UnitY());
  }
  return pose;
}

/// Everything but the arms and hands is so much wider, to the sides and in front.
Body fat(double factor) {
  Body body = person();
  for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
    float trunk = 0;
    for (const int j : {kPelvis, kSpine1, kSpine2, kSpine3, kLeftHip, kRightHip})
      trunk += body.weights(static_cast<Eigen::Index>(v), j);
    Point& p = body.rest.vertices[v];
    p.x() *= 1 + (static_cast<float>(factor) - 1) * trunk;
    p.z() *= 1 + (static_cast<float>(factor) - 1) * trunk;
  }
  return body;
}

/// The same person whose arms are so much longer.
Body with_arms(double factor) {
  Body body = person();
  for (const int side : {0, 1}) {
    const Vec3 shoulder = body.joints[static_cast<size_t>(kLeftShoulder + side)];
    for (const int j : {kLeftElbow, kLeftWrist}) {
      Vec3& x = body.joints[static_cast<size_t>(j + side)];
      x = shoulder + factor * (x - shoulder);
    }
    for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
      Point& p = body.rest.vertices[v];
      if (side == 0 ? p.x() > shoulder.x() : p.x() < shoulder.x())
        p.x() = static_cast<float>(shoulder.x() + factor * (p.x() - shoulder.x()));
    }
  }
  return body;
}

/// Where the target's pose is copied from the source's and then corrected.
Pose performed(const Body& source, const Body& target, const Pose& source_pose) {
  const PartSurfaces theirs = surfaces_of(source);
  const PosedSkeleton posed = forward_kinematics(source.joints, source_pose);
  Pose pose = source_pose;
  pose.root = target.joints[kPelvis];
  const Contacts contacts(surfaces_of(target));
  move_hands(target.joints, contacts.moves({theirs, posed}, target.joints, pose), &pose);
  return pose;
}

/// How far the nearest vertex of the trunk is from the nearest of the left hand, metres.
double hand_to_trunk(const Body& body, const Pose& pose) {
  const Points surface = linear_blend_skinning(body, pose);
  double out = 1e9;
  for (Eigen::Index h = 0; h < body.weights.rows(); ++h) {
    if (body.weights(h, kLeftWrist) < 0.9f) continue;
    for (Eigen::Index t = 0; t < body.weights.rows(); ++t)
      if (body.weights(t, kSpine1) + body.weights(t, kPelvis) + body.weights(t, kSpine2) > 0.7f)
        out = std::min(
            out, static_cast<double>(
                     (surface[static_cast<size_t>(h)] - surface[static_cast<size_t>(t)]).norm()));
  }
  return out;
}

double wrists_in_arms(const Body& body, const Pose& pose) {
  const Joints x = forward_kinematics(body.joints, pose).joints;
  const double arm =
      (x[kLeftElbow] - x[kLeftShoulder]).norm() + (x[kLeftWrist] - x[kLeftElbow]).norm();
  return (x[kRightWrist] - x[kLeftWrist]).norm() / arm;
}

TEST(PartSurfaces, APlaceIsFoundAgain) {
  const PartSurfaces surfaces = surfaces_of(person());
  const PosedSkeleton posed = forward_kinematics(person().joints, with_left_arm(person(), 60, 80));
  for (int p = 0; p < kParts; ++p)
    for (const Vec3& from : {Vec3(0.3, 0.9, 0.2), Vec3(-0.1, 1.7, -0.4), Vec3(0.4, 0.1, 0.3)}) {
      const auto part = static_cast<BodyPart>(p);
      const NearPart near = surfaces.locate(part, posed, from);
      const Vec3 again = surfaces.point(part, posed, near.place, near.over);
      EXPECT_LT((again - from).norm(), 1e-6) << "part " << p;
    }
}

TEST(PartSurfaces, TheSurfaceOfABodyIsWhereItsVerticesAre) {
  const Body& body = person();
  const PartSurfaces surfaces = surfaces_of(body);
  const Pose pose = with_left_arm(body, 60, 80);
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  const Points points = linear_blend_skinning(body, pose);
  std::vector<double> off;
  for (size_t v = 0; v < points.size(); v += 5) {
    double nearest = 1e9;
    for (int p = 0; p < kParts; ++p) {
      const NearPart near =
          surfaces.locate(static_cast<BodyPart>(p), posed, points[v].cast<double>());
      nearest = std::min(nearest, std::abs(near.over));
    }
    off.push_back(nearest);
  }
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 0.004);
  EXPECT_LT(off[off.size() * 95 / 100], 0.02);
}

TEST(Contacts, TheSamePersonDoesTheSame) {
  for (const Pose& pose : {with_left_arm(person(), 70, 120), clapping(person(), 70)}) {
    const Pose out = performed(person(), person(), pose);
    for (size_t j = 0; j < kJoints; ++j) EXPECT_TRUE(out.local[j].isApprox(pose.local[j], 1e-9));
  }
}

TEST(Contacts, AHandOnABellyIsOnAnyBelly) {
  double bent = 60;
  while (bent < 140 && hand_to_trunk(person(), with_left_arm(person(), 60, bent)) > 0.03) bent += 2;
  const Pose pose = with_left_arm(person(), 60, bent);
  const double source = hand_to_trunk(person(), pose);
  ASSERT_LT(source, 0.03) << "the source's hand has to touch";
  for (const double factor : {0.7, 1.4}) {
    const Body target = fat(factor);
    EXPECT_NEAR(hand_to_trunk(target, performed(person(), target, pose)), source, 0.02) << factor;
    if (factor < 1) {
      EXPECT_GT(hand_to_trunk(target, pose), 0.05) << "copying is not enough";
    }
  }
}

TEST(Contacts, HandsKeepTheirDistanceInLengthsOfTheArm) {
  double bent = 20;
  while (bent < 150 && wrists_in_arms(person(), clapping(person(), bent)) > 0.4) bent += 2;
  const Pose pose = clapping(person(), bent);
  const double source = wrists_in_arms(person(), pose);
  ASSERT_LT(source, 0.4) << "the source's hands have to be near each other";
  double missed = 0;
  for (const double factor : {0.7, 1.3}) {
    const Body target = with_arms(factor);
    missed = std::max(missed, std::abs(wrists_in_arms(target, pose) - source));
    EXPECT_NEAR(wrists_in_arms(target, performed(person(), target, pose)), source, 0.05) << factor;
  }
  EXPECT_GT(missed, 0.08) << "copying is not enough";
}

TEST(Contacts, HandsThatAreFarFromEverythingStay) {
  const Pose pose = with_left_arm(person(), 20, 20);
  const Pose out = performed(person(), with_arms(1.3), pose);
  for (size_t j = 0; j < kJoints; ++j) EXPECT_EQ(out.local[j], pose.local[j]);
}

TEST(Contacts, NothingJumpsWhileAHandComesNear) {
  const Body target = fat(1.4);
  std::optional<Vec3> before;
  for (double bent = 60; bent <= 130; bent += 0.5) {  // a forearm moves 2 mm a step at its end
    const Pose out = performed(person(), target, with_left_arm(person(), 70, bent));
    const Vec3 wrist = forward_kinematics(target.joints, out).joints[kLeftWrist];
    if (before) {
      EXPECT_LT((wrist - *before).norm(), 0.01) << bent;
    }
    before = wrist;
  }
}

TEST(Contacts, AFigureWithoutASurfaceIsTaken) {
  Body bones = person();
  bones.rest.vertices.clear();
  bones.weights.resize(0, kJoints);
  const Pose pose = clapping(person(), 70);
  const Pose out = performed(person(), bones, pose);
  for (const Mat3& r : out.local) EXPECT_TRUE(r.allFinite());
}

/// Short upper arms: their wrists cannot come nearer to the shoulder than the bones differ.
TEST(Contacts, AnArmOfUnequalBonesIsNotFoldedThrough) {
  Body target = person();
  for (const int side : {0, 1}) {
    const Vec3 shoulder = target.joints[static_cast<size_t>(kLeftShoulder + side)],
               wrist = target.joints[static_cast<size_t>(kLeftWrist + side)];
    target.joints[static_cast<size_t>(kLeftElbow + side)] = shoulder + 0.3 * (wrist - shoulder);
  }
  for (const double bent : {110.0, 130.0, 150.0}) {
    const Pose pose = performed(person(), target, with_left_arm(person(), 60, bent));
    const Joints x = forward_kinematics(target.joints, pose).joints;
    const double upper = (x[kLeftElbow] - x[kLeftShoulder]).norm(),
                 lower = (x[kLeftWrist] - x[kLeftElbow]).norm();
    EXPECT_GT((x[kLeftWrist] - x[kLeftShoulder]).norm(), lower - upper + 0.05 * (upper + lower))
        << bent;
  }
}

TEST(Contacts, ElbowsFollowTheirOwnMoves) {
  const Joints& rest = person().joints;
  const Pose copied = with_left_arm(person(), 60, 80);
  const std::array<Vec3, 2> by = {Vec3(-0.15, 0.2, -0.1), Vec3::Zero()};
  Pose plain = copied, smooth = copied, held = copied;
  move_hands(rest, by, &plain);
  const std::array<Vec3, 2> elbows = elbows_moved(rest, by, copied);
  move_hands(rest, by, elbows, &smooth);
  move_hands(rest, by, {0.1 * elbows[0], Vec3::Zero()}, &held);
  const Joints before = forward_kinematics(rest, copied).joints,
               own = forward_kinematics(rest, plain).joints,
               same = forward_kinematics(rest, smooth).joints,
               near = forward_kinematics(rest, held).joints;
  EXPECT_LT((elbows[0] - own[kLeftElbow] + before[kLeftElbow]).norm(), 1e-12);
  EXPECT_LT((same[kLeftElbow] - own[kLeftElbow]).norm(), 1e-9);
  EXPECT_LT((near[kLeftElbow] - before[kLeftElbow]).norm(), 0.95 * elbows[0].norm());
  EXPECT_LT((near[kLeftWrist] - own[kLeftWrist]).norm(), 1e-9) << "the hand stays";
  EXPECT_LT((near[kRightElbow] - before[kRightElbow]).norm(), 1e-12);
}

}  // namespace
}  // namespace restage
