// Joints of one definition from those of another (nn/geometry/joint_definition.h).
#include "nn/geometry/joint_definition.h"

#include <gtest/gtest.h>

#include "autograd/base/error.h"

namespace restage {
namespace {

/// The mean of 160 MakeHuman bodies in T-pose, millimetres; right joints are mirrored.
Joints mean_body() {
  Joints out;
  const std::pair<int, Vec3> left_and_middle[] = {
      {kPelvis, {0, 901, 13}},       {kLeftHip, {107, 888, 4}},    {kSpine1, {0, 981, -25}},
      {kLeftKnee, {146, 492, 36}},   {kSpine2, {0, 1048, -11}},    {kLeftAnkle, {187, 73, 14}},
      {kSpine3, {0, 1122, -14}},     {kLeftFoot, {190, 9, 136}},   {kNeck, {0, 1442, 13}},
      {kLeftCollar, {23, 1369, 28}}, {kHead, {0, 1539, 47}},       {kLeftShoulder, {175, 1346, 23}},
      {kLeftElbow, {425, 1346, 23}}, {kLeftWrist, {666, 1346, 23}}};
  for (const auto& [j, mm] : left_and_middle) {
    const Vec3 at = mm / 1000;
    out[static_cast<size_t>(j)] = at;
    out[static_cast<size_t>(kMirror[static_cast<size_t>(j)])] = Vec3(-at.x(), at.y(), at.z());
  }
  return out;
}

double apart(const Joints& joints, int a, int b) {
  return (joints[static_cast<size_t>(a)] - joints[static_cast<size_t>(b)]).norm();
}

TEST(JointDefinition, GivesTheBonesOfSmpl) {
  const Joints smpl = JointConversion("makehuman", "smpl", "body")(mean_body());
  // Published bones of SMPL's mean skeleton, 0.99 times as large here.
  EXPECT_NEAR(apart(smpl, kLeftHip, kRightHip), 0.139, 0.01);
  EXPECT_NEAR(apart(smpl, kSpine3, kNeck), 0.216, 0.02);
  EXPECT_NEAR(apart(smpl, kSpine1, kSpine2), 0.134, 0.02);
  EXPECT_NEAR(apart(smpl, kLeftKnee, kLeftAnkle), 0.398, 0.01);
  EXPECT_NEAR(apart(smpl, kLeftElbow, kLeftWrist), 0.247, 0.01);
  EXPECT_GT(apart(mean_body(), kSpine3, kNeck), 0.3);
}

TEST(JointDefinition, GoesThereAndBack) {
  const Joints body = mean_body();
  const Joints back = JointConversion("smpl", "makehuman",
                                      "body")(JointConversion("makehuman", "smpl", "body")(body));
  for (size_t j = 0; j < kJoints; ++j)
    EXPECT_LT((back[j] - body[j]).norm(), 0.02) << kJointNames[j];
}

TEST(JointDefinition, TurnsAndMovesWithThePerson) {
  const JointConversion convert("makehuman", "smpl", "body");
  const Joints body = mean_body(), there = convert(body);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  Joints moved;
  for (size_t j = 0; j < kJoints; ++j) moved[j] = 1.3 * (turn * body[j]) + Vec3(4, -5, 6);
  const Joints other = convert(moved);
  for (size_t j = 0; j < kJoints; ++j)
    EXPECT_LT((other[j] - (1.3 * (turn * there[j]) + Vec3(4, -5, 6))).norm(), 1e-12);
}

TEST(JointDefinition, KnowsNoSide) {
  const JointConversion convert("smpl", "makehuman", "body");
  Joints body = mean_body();
  body[kLeftWrist] += Vec3(0.1, -0.3, 0.2);
  body[kRightKnee] += Vec3(0.05, 0.1, 0.3);
  Joints mirrored;
  const auto mirror = [](const Joints& in) {
    Joints out;
    for (size_t j = 0; j < kJoints; ++j)
      out[j] = in[static_cast<size_t>(kMirror[j])].cwiseProduct(Vec3(-1, 1, 1));
    return out;
  };
  const Joints a = mirror(convert(body)), b = convert(mirror(body));
  for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((a[j] - b[j]).norm(), 1e-12) << kJointNames[j];
}

TEST(JointDefinition, FramesAreConvertedLikeOneSkeleton) {
  const JointConversion convert("makehuman", "smpl", "body");
  const Joints body = mean_body(), one = convert(body);
  std::vector<double> frames;
  for (int f = 0; f < 2; ++f)
    for (const Vec3& p : body) frames.insert(frames.end(), {p.x(), p.y(), p.z()});
  convert.convert(frames);
  for (size_t i = 0; i < frames.size(); ++i)
    EXPECT_NEAR(frames[i], one[i / 3 % kJoints][static_cast<int>(i % 3)], 1e-12);
}

TEST(JointDefinition, RefusesWhatItCannotConvert) {
  EXPECT_NO_THROW(JointConversion("mine", "mine", "a.h5"));
  EXPECT_THROW(JointConversion("rig", "smpl", "a.h5"), InputError);
  EXPECT_THROW(JointConversion("", "smpl", "a.h5"), InputError);
  EXPECT_THROW(JointConversion("smpl", "cmu", "a.h5"), InputError);
}

TEST(JointDefinition, TellsTwoFromOne) {
  EXPECT_EQ(common_definition({{"", "a"}, {"smpl", "b"}, {"smpl", "c"}}), "smpl");
  EXPECT_EQ(common_definition({{"", "a"}}), "");
  EXPECT_EQ(common_definition({{"builtin", "a"}, {"smpl", "b"}, {"builtin", "c"}}), "smpl");
  EXPECT_THROW(common_definition({{"builtin", "a"}, {"smpl", "b"}, {"makehuman", "c"}}),
               InputError);
  try {
    common_definition({{"smpl", "a.h5"}, {"", "b.h5"}, {"makehuman", "c.h5"}}, "choose");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "c.h5: has joints of 'makehuman', but a.h5 has those of 'smpl'; choose");
  }
}

}  // namespace
}  // namespace restage
