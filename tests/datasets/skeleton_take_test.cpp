// A skeleton's motion taken over by another: the same turns, to rounding; a place that fits.
#include "datasets/importers/motions/skeleton_take.h"

#include <gtest/gtest.h>

#include <functional>

#include "autograd/base/format.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/schema.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/smpl_support.h"

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

/// Programs write a still clip first, of the pose in which a rig was made.
TEST_F(SkeletonTakeTest, OfSeveralClipsTheFirstThatMovesIsTaken) {
  testing::KnownCharacter known = known_;
  known.pose = [still = known_.pose(0)](double) { return still; };
  CharacterMaker maker(known, testing::plain_style());
  known.pose = known_.pose;
  maker.add_motion("moves");
  maker.add_motion("moves too");
  maker.parts.root["animations"][0]["name"] = "Take 001";
  const std::string path = dir.write("in.glb", maker.parts.glb());
  const SkeletonTake take = read_take(path, {});
  EXPECT_EQ(take.name, "moves");
  EXPECT_GT((take.frames.back().joints[kLeftWrist] - take.frames[0].joints[kLeftWrist]).norm(),
            0.05);
  TakeOptions other;
  other.clip = "moves too";
  EXPECT_EQ(read_take(path, other).name, "moves too");
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
  EXPECT_HAS(refusal_of([&] { read_take(path, {.clip = "walk"}); }), "leave clip out");
}

TEST_F(SkeletonTakeTest, WhatHoldsOne) {
  EXPECT_TRUE(holds_take(write(testing::mixamo_style())));
  testing::GlbParts still = CharacterMaker(known_, testing::mixamo_style()).parts;
  still.root.erase("animations");
  EXPECT_HAS(refusal_of([&] { holds_take(dir.write("still.glb", still.glb())); }),
             "is a character without an animation; give one that moves");
  EXPECT_FALSE(holds_take(write(testing::vrm_style()))) << "names that say nothing";
  EXPECT_FALSE(holds_take(dir / "none.ply"));
  EXPECT_FALSE(holds_take(dir.path()));
  EXPECT_THROW(holds_take(dir.write("bad.glb", "glTF")), InputError);
}

/// Axis-angle numbers turn about fixed axes, so turns at 30 fps are known.
class ParametersTest : public FileTest {
 protected:
  std::string clip_file(const test::TinyClip& clip) const {
    auto arrays = clip.arrays();
    for (auto& [name, content] : arrays)
      if (name == "poses") content = poses_with_fingers(clip);
    return dir.write("walk_poses.npz", npz(arrays));
  }
  /// The left middle finger (index, middle, little, ring, thumb in the file) bends.
  static std::string poses_with_fingers(const test::TinyClip& clip) {
    std::vector<double> poses;
    for (int64_t f = 0; f < clip.frames; ++f) {
      const double t = static_cast<double>(f) / clip.fps;
      const Eigen::AngleAxisd first(clip.root(t));
      for (int64_t i = 0; i < clip.width() / 3; ++i) {
        const int64_t hand = i - (clip.width() / 3 - 30);
        Vec3 a = i == 0        ? Vec3(first.angle() * first.axis())
                 : i < kJoints ? clip.turn(static_cast<int>(i), t)
                               : Vec3(Vec3::Zero());
        if (hand >= 3 && hand < 6) a = Vec3(0, 0, 0.4 * t);
        poses.insert(poses.end(), a.data(), a.data() + 3);
      }
    }
    return npy<double>({clip.frames, clip.width()}, poses);
  }
  static Mat3 z_to_y() { return Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitX()).toRotationMatrix(); }
  static Rotations turns(const test::TinyClip& clip, double t) {
    Rotations local;
    local[0] = z_to_y() * clip.root(t);
    for (size_t j = 1; j < kJoints; ++j) {
      const Vec3 a = clip.turn(static_cast<int>(j), t);
      local[j] =
          Eigen::AngleAxisd(a.norm(), a.norm() > 0 ? Vec3(a.normalized()) : Vec3(Vec3::UnitX()))
              .toRotationMatrix();
    }
    return to_global(local);
  }
};

TEST_F(ParametersTest, TurnsGoOverWithAndWithoutABodyModel) {
  for (const SmplFamily family : {SmplFamily::smplh, SmplFamily::smplx}) {
    test::TinyClip clip;
    clip.family = family;
    const std::string path = clip_file(clip);
    ASSERT_TRUE(holds_take(path));
    TakeOptions options;
    options.like = testing::tiny_joints();
    for (Vec3& x : *options.like) x *= 1.3;
    const SkeletonTake bare = read_take(path, options);
    EXPECT_HAS(remarks(bare.report), "no body model");
    options.body_model = dir.write("model.npz", test::TinySmpl{family}.file());
    const SkeletonTake full = read_take(path, options);
    EXPECT_EQ(full.name, "walk_poses");
    for (const SkeletonTake* take : {&bare, &full}) {
      ASSERT_EQ(take->frames.size(), 31u);
      ASSERT_EQ(take->fingers.size(), 31u);
      for (size_t f = 0; f < 31; f += 6) {
        const double t = static_cast<double>(f) / kFps;
        const Rotations wanted = turns(clip, t);
        for (size_t j = 0; j < kJoints; ++j)
          EXPECT_LT((take->frames[f].global[j] - wanted[j]).norm(), 1e-4) << f << " " << j;
        const auto& middle = take->fingers[f];
        for (int bone = 0; bone < 3; ++bone) {
          const Mat3 bent =
              Eigen::AngleAxisd(0.4 * t * (bone + 1), Vec3::UnitZ()).toRotationMatrix();
          EXPECT_LT(
              (*middle[static_cast<size_t>(finger_bone(0, 2, bone))] - wanted[kLeftWrist] * bent)
                  .norm(),
              1e-4);
          EXPECT_LT(
              (*middle[static_cast<size_t>(finger_bone(1, 2, bone))] - wanted[kRightWrist]).norm(),
              1e-4);
        }
      }
    }
    // Without a model, the turns of who performs are the file's.
    const Pose pose = perform_take(bare, 12, *options.like);
    const Rotations global = to_global(pose.local), wanted = turns(clip, 12 / kFps);
    for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((global[j] - wanted[j]).norm(), 1e-4);
  }
}

/// Two frames of 22 joints and a finger; in the second the elbow and the finger bend about z by
/// these degrees.
std::string recording_with_a_finger(double elbow, double finger) {
  const Joints& at = bvh_test::rest();
  std::string motion[2] = {"0 95 0", "0 95 0"};
  const std::string channels = "3 Zrotation Xrotation Yrotation\n";
  const std::function<std::string(int, const Vec3&)> joint = [&](int j, const Vec3& from) {
    const Vec3 offset = 100 * (at[static_cast<size_t>(j)] - from);
    std::string out =
        (j == 0 ? "ROOT " : "JOINT ") + std::string(bvh_test::kMixamo[j]) + "\n{\n" +
        format("OFFSET %.6f %.6f %.6f\nCHANNELS ", offset.x(), offset.y(), offset.z()) +
        (j == 0 ? "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n" : channels);
    motion[0] += " 0 0 0";
    motion[1] += j == kLeftElbow ? format(" %g 0 0", elbow) : " 0 0 0";
    for (int child = j + 1; child < kJoints; ++child)
      if (kParents[child] == j) out += joint(child, at[static_cast<size_t>(j)]);
    if (j == kLeftWrist) {
      out += "JOINT mixamorig:LeftHandIndex1\n{\nOFFSET 8 0 2\nCHANNELS " + channels +
             "End Site\n{\nOFFSET 3 0 0\n}\n}\n";
      motion[0] += " 0 0 0";
      motion[1] += format(" %g 0 0", finger);
    }
    if (j == kHead) out += "End Site\n{\nOFFSET 0 10 0\n}\n";
    return out + "}\n";
  };
  const std::string tree = "HIERARCHY\n" + joint(0, Vec3::Zero());
  return tree + "MOTION\nFrames: 2\nFrame Time: 0.033333333\n" + motion[0] + "\n" + motion[1] +
         "\n";
}

TEST_F(SkeletonTakeTest, FingersOfARecording) {
  TakeOptions options;
  options.motion.fingers = true;
  const SkeletonTake bent = read_take(dir.write("a.bvh", recording_with_a_finger(20, 30)), options);
  ASSERT_EQ(bent.fingers.size(), 2u);
  const auto index = static_cast<size_t>(finger_bone(0, 1, 0));
  for (size_t k = 0; k < kFingerBones; ++k) EXPECT_EQ(bent.fingers[1][k].has_value(), k == index);
  const Mat3 wanted = Eigen::AngleAxisd(50 * M_PI / 180, Vec3::UnitZ()).toRotationMatrix();
  EXPECT_LT((*bent.fingers[1][index] - wanted).norm(), 1e-6);
  // Fingers that a recording only carries along are left alone.
  EXPECT_TRUE(
      read_take(dir.write("b.bvh", recording_with_a_finger(20, 0)), options).fingers.empty());
}

TEST_F(SkeletonTakeTest, OurOwnMotions) {
  std::vector<Motion> motions = {testing::tiny_motion("a", "ann", "train", 12),
                                 testing::tiny_motion("b", "bob", "test", 7)};
  write_motions(dir / "one.h5", {motions[1]}, {});
  write_motions(dir / "two.h5", motions, {});
  const std::string one = dir / "one.h5", two = dir / "two.h5";
  ASSERT_TRUE(holds_take(one));
  const SkeletonTake take = read_take(one, {});
  EXPECT_EQ(take.name, "b");
  const Body body = testing::tiny_body("own", "test");
  ASSERT_EQ(take.frames.size(), 7u);
  for (size_t f = 0; f < 7; ++f) {
    const Pose is = perform_take(take, f, body.joints), wanted = pose_on(motions[1], body, f);
    for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((is.local[j] - wanted.local[j]).norm(), 1e-5);
    EXPECT_LT((is.root - wanted.root).head<1>().norm(), 0.02);
  }
  EXPECT_EQ(read_take(two, {.clip = "a"}).frames.size(), 12u);
  EXPECT_EQ(read_take(two, {.sequence = 1}).frames.size(), 7u);
  EXPECT_HAS(refusal_of([&] { read_take(two, {}); }), "holds 2 motions");
  EXPECT_HAS(refusal_of([&] { read_take(two, {.clip = "c"}); }), "no motion 'c'");
  EXPECT_HAS(refusal_of([&] { read_take(two, {.sequence = 2}); }), "no number 2");
  Scans scans{{Point(0, 0, 0)}, {0, 1}, {0, 1}};
  write_scans(dir / "scans.h5", scans, {});
  EXPECT_FALSE(holds_take(dir / "scans.h5"));
}

}  // namespace
}  // namespace restage
