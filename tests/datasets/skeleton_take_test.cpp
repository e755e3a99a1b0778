// A skeleton's motion taken over by another: the same turns, to rounding; a place that fits.
#include "datasets/importers/skeleton_take.h"

#include <gtest/gtest.h>

#include "datasets/importers/gltf_character.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_support.h"

namespace restage {
namespace {

using namespace test;
using testing::CharacterMaker;
using testing::RigStyle;

class SkeletonTakeTest : public FileTest {
 protected:
  std::string write(const RigStyle& style) const {
    return dir.write("in.glb", CharacterMaker(known_, style).parts.glb());
  }
  /// Rest joints on the floor, as targets have them.
  Joints standing(double size) const {
    float floor = 1e9f;
    for (const Point& p : known_.body.rest.vertices) floor = std::min(floor, p.y());
    Joints out = known_.body.joints;
    for (Vec3& x : out) x = size * (x - Vec3(0, double{floor}, 0));
    return out;
  }
  const testing::KnownCharacter known_ = testing::known_character();
};

TEST_F(SkeletonTakeTest, TheSameSkeletonDoesTheSame) {
  RigStyle fine = testing::unreal_style();
  fine.fps = 60, fine.keys = 61;
  for (const RigStyle& style : {testing::plain_style(), testing::mixamo_style(), fine}) {
    const SkeletonTake p = read_take(write(style), {});
    ASSERT_EQ(p.frames.size(), 31u);
    const Joints rest = standing(1);
    double floor = rest[0].y() - p.rest[0].y();  // of the file's world
    for (size_t f = 0; f < p.frames.size(); ++f) {
      const Pose truth = known_.pose(static_cast<double>(f) / kFps);
      const Pose got = perform_take(p, f, rest);
      const PosedSkeleton wanted = forward_kinematics(rest, truth),
                          is = forward_kinematics(rest, got);
      for (int j = 0; j < kJoints; ++j) {
        EXPECT_LT(Quat(is.global[j]).angularDistance(Quat(wanted.global[j])), 0.004)
            << f << " " << j;
        EXPECT_LT((is.joints[j] - wanted.joints[j] - Vec3(0, floor, 0)).norm(), 1e-3)
            << f << " " << j;
      }
    }
  }
}

TEST_F(SkeletonTakeTest, AnotherSizeGoesAnotherWay) {
  const SkeletonTake p = read_take(write(testing::plain_style()), {});
  const Joints rest = standing(1.5);
  for (size_t f = 0; f < p.frames.size(); f += 5) {
    const Pose same = perform_take(p, f, standing(1)), large = perform_take(p, f, rest);
    EXPECT_LT((large.root - 1.5 * same.root).norm(), 1e-6);
    for (int j = 0; j < kJoints; ++j) EXPECT_LT((large.local[j] - same.local[j]).norm(), 1e-9);
  }
}

/// Where the rest pose of a target has its thighs apart, they point where the source's do.
TEST_F(SkeletonTakeTest, LimbsPointAsTheSourcesDo) {
  const SkeletonTake p = read_take(write(testing::plain_style()), {});
  Joints apart = standing(1);
  for (const int side : {0, 1}) {
    const Mat3 turn = Eigen::AngleAxisd(side == 0 ? 0.2 : -0.2, Vec3::UnitZ()).toRotationMatrix();
    const Vec3 hip = apart[static_cast<size_t>(1 + side)];
    for (const int j : {4, 7, 10}) {
      Vec3& x = apart[static_cast<size_t>(j + side)];
      x = hip + turn * (x - hip);
    }
  }
  for (size_t f = 0; f < p.frames.size(); f += 5) {
    const PosedSkeleton a = forward_kinematics(standing(1), perform_take(p, f, standing(1)));
    const PosedSkeleton b = forward_kinematics(apart, perform_take(p, f, apart));
    for (const auto& [from, to] : {std::pair{1, 4}, {4, 7}, {2, 5}, {5, 8}, {16, 18}})
      EXPECT_LT(((a.joints[to] - a.joints[from]) - (b.joints[to] - b.joints[from])).norm(), 1e-9);
  }
}

TEST_F(SkeletonTakeTest, RecordingsStandOnTheFloor) {
  const std::string path = dir.write("07_01.bvh", bvh_test::text({}));
  ASSERT_TRUE(holds_take(path));
  MotionOptions all;
  all.drop_leading = 0;
  const SkeletonTake p = read_take(path, {.motion = all});
  EXPECT_EQ(p.name, "07_01");
  EXPECT_EQ(p.frames.size(), 31u);
  std::vector<double> lowest;
  for (size_t f = 0; f < p.frames.size(); ++f)
    lowest.push_back(lowest_foot(forward_kinematics(standing(1), perform_take(p, f, standing(1)))));
  const Joints rest = standing(1);
  const double sole = std::min({rest[7].y(), rest[8].y(), rest[10].y(), rest[11].y()});
  EXPECT_NEAR(floor_height(lowest), sole, 0.03);
  EXPECT_HAS(refusal_of([&] { read_take(path, {.clip = "walk"}); }), "leave --clip out");
}

TEST_F(SkeletonTakeTest, WhatHoldsOne) {
  EXPECT_TRUE(holds_take(write(testing::mixamo_style())));
  testing::GlbParts still = CharacterMaker(known_, testing::mixamo_style()).parts;
  still.root.erase("animations");
  EXPECT_FALSE(holds_take(dir.write("still.glb", still.glb())));
  EXPECT_FALSE(holds_take(write(testing::vrm_style()))) << "names that say nothing";
  EXPECT_FALSE(holds_take(dir / "none.ply"));
  EXPECT_FALSE(holds_take(dir.path()));
  EXPECT_THROW(holds_take(dir.write("bad.glb", "glTF")), InputError);
}

}  // namespace
}  // namespace restage
