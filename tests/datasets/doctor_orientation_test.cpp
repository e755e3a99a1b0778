// Which way people in scans are up and face, and in which unit.
#include <gtest/gtest.h>

#include "autograd/base/error.h"
#include "datasets/doctor/orientation_model.h"
#include "tests/support/doctor_people.h"

namespace restage {
namespace {

TEST(DoctorOrientation, HypothesesAreProperTurns) {
  int permutations = 0;
  for (int up = 0; up < 6; ++up)
    for (int heading = 0; heading < 24; ++heading) {
      const Eigen::Matrix3f turn = doctor_detail::hypothesis(up, heading);
      EXPECT_NEAR(turn.determinant(), 1, 1e-5);
      EXPECT_TRUE((turn * direction(up).cast<float>()).isApprox(Point::UnitY(), 1e-5f));
      permutations += turn.isApprox(turn.array().round().matrix(), 0);
    }
  EXPECT_EQ(permutations, 24);
}

TEST(DoctorOrientation, EveryAxisAndUnitOfAScanIsFound) {
  const Points rest = scan(somebody());
  size_t unit = 0;
  for (int up = 0; up < 6; ++up)
    for (int facing = 0; facing < 6; ++facing) {
      if (facing / 2 == up / 2) continue;
      const LengthUnit length = kUnits[unit++ % kUnits.size()];
      const Points foreign = moved(rest, into_foreign(up, facing), 1 / length.metres);
      const Diagnosis d = examine_surface(cloud(foreign));
      EXPECT_EQ(d.orientation.up, up);
      EXPECT_EQ(d.orientation.facing, facing);
      EXPECT_GT(d.orientation.up_sure, 0.9);
      EXPECT_EQ(d.unit.unit.metres, length.metres);
      EXPECT_EQ(d.usable(), up == 2 && length.metres == 1);
      // The transform brings every point back to where it was, and there again.
      ASSERT_TRUE(d.transform);
      for (size_t i = 0; i < rest.size(); i += 100) {
        EXPECT_LT(((*d.transform)(foreign[i]) - rest[i]).norm(), 1e-4f);
        EXPECT_LT((d.transform->undo((*d.transform)(foreign[i])) - foreign[i]).norm(),
                  1e-4 / length.metres);
      }
    }
}

TEST(DoctorOrientation, PeopleInMotionAreSeldomTakenForOthers) {
  int up = 0, facing = 0, all = 0;
  for (int k = 0; k < 22; ++k) {
    const Motion motion = builtin_motion(0, "test", k);
    for (const size_t frame : {motion.frames() / 3, 2 * motion.frames() / 3}) {
      OrientationVote vote;
      vote.add(scan(somebody(), &motion, frame, static_cast<uint64_t>(k)));
      const Orientation o = vote.result();
      up += o.up == 2;
      facing += o.up == 2 && o.facing == 4;
      ++all;
    }
  }
  EXPECT_EQ(up, all);
  EXPECT_GE(facing, all - 1);
}

TEST(DoctorOrientation, WhatIsNoPersonIsUnsure) {
  Rng rng(RngKey{5, 0});
  Points ball;
  for (int i = 0; i < 600; ++i)
    ball.push_back(Point(static_cast<float>(rng.normal()), static_cast<float>(rng.normal()),
                         static_cast<float>(rng.normal())) *
                   70);
  const Diagnosis d = examine_surface(cloud(ball));
  EXPECT_TRUE(notes(d, "up", "nobody"));
  EXPECT_FALSE(d.usable());
  EXPECT_THROW(check_target(cloud(ball), "ball"), InputError);
  EXPECT_LT(d.unit.sure, 0.5) << "a unit is told by a person's size";
  EXPECT_EQ(guess_unit(0).sure, 0);
  EXPECT_LT(guess_unit(1e30).sure, 1e-6);
}

TEST(DoctorOrientation, KnownBetterBeatsFound) {
  const Mesh mesh = cloud(scan(somebody()));
  ExamineOptions known;
  known.scale = 0.5;
  known.up = 4;
  known.facing = 0;
  const Diagnosis d = examine_surface(mesh, known);
  EXPECT_EQ(d.transform->scale, 0.5);
  EXPECT_TRUE((d.transform->rotation * Vec3::UnitZ()).isApprox(Vec3::UnitY()));
  EXPECT_TRUE((d.transform->rotation * Vec3::UnitX()).isApprox(Vec3::UnitZ()));
  known.facing = 5;
  EXPECT_THROW(examine_surface(mesh, known), InputError);
}

}  // namespace
}  // namespace restage
