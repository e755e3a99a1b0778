// Joints in lines of JSON: their times, broken lines, and names of joints.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "autograd/base/format.h"
#include "datasets/builtin/bodies.h"
#include "datasets/importers/joints/solve.h"
#include "tests/datasets/importers_support.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using namespace test;

constexpr double kSpeed = 0.3;  // metres a second, along z

class JointTimes : public FileTest {
 protected:
  static Joints standing_at(double seconds) {
    Joints out = builtin_rest_joints();
    for (Vec3& x : out) x += Vec3(0.02 * std::sin(9 * seconds), 1, kSpeed * seconds);
    return out;
  }
  static std::string joints_at(double seconds) {
    std::string out;
    for (const Vec3& x : standing_at(seconds))
      out += format("%s[%.6f, %.6f, %.6f]", out.empty() ? "" : ", ", x.x(), x.y(), x.z());
    return out;
  }
  /// A line of what was at `at`, which says it was at `says`.
  static std::string line(double at, double says) {
    return format("{\"time\": %.6f, \"joints\": [", says) + joints_at(at) + "]}\n";
  }
  static std::string line(double at) { return line(at, at); }
  JointRecording read(const std::string& text) {
    return *find_joint_recording(dir.write("take.jsonl", text), {});
  }
  std::string refused(const std::string& text) {
    return refusal_of([&] { read(text); });
  }
  static std::string all_of(const std::vector<std::string>& remarks) {
    std::string out;
    for (const std::string& remark : remarks) out += remark + "\n";
    return out;
  }
  Motion solve(const JointRecording& recording, bool force = false) {
    ImportReport report;
    report.file = "take.jsonl";
    MotionOptions options;
    options.force = force;
    return solve_joints(recording, options, report).motion;
  }
  /// The largest distance of the hips' height along z from where they were, metres.
  static double off(const Motion& motion) {
    double out = 0;
    for (size_t f = 0; f < motion.frames(); ++f)
      out = std::max(out, std::abs(motion.hips[f].z() - motion.hips[0].z() -
                                   kSpeed * static_cast<double>(f) / kFps));
    return out;
  }
};

TEST_F(JointTimes, WhatIsMissingIsFoundBetween) {
  std::string text;
  for (int f = 0; f < 60; ++f)
    if (f < 20 || f >= 28) text += line(f / 30.0);
  const JointRecording got = read(text);
  EXPECT_EQ(got.fps, 30);
  EXPECT_EQ(got.frames.size(), 60u);
  EXPECT_HAS(all_of(got.remarks), "8 lines are missing");
  EXPECT_LT(off(solve(got)), 5e-3);
}

TEST_F(JointTimes, ALongGapIsRefusedOrForced) {
  std::string text;
  for (int f = 0; f < 90; ++f)
    if (f < 30 || f >= 60) text += line(f / 30.0);
  const JointRecording got = read(text);
  EXPECT_HAS(refusal_of([&] { solve(got); }), "has nothing for 1.033 s after line 30");
  const Motion forced = solve(got, true);
  EXPECT_EQ(forced.frames(), 90u);
  EXPECT_LT(off(forced), 5e-3);
  std::string hour;
  for (int f = 0; f < 60; ++f) hour += line(f / 30.0, f / 30.0 + (f < 30 ? 0 : 3600));
  EXPECT_HAS(refused(hour), "a file for each recording");
}

TEST_F(JointTimes, LinesWhoseTimeDoesNotGoOnAreLeftOut) {
  std::string text;
  for (int f = 0; f < 60; ++f) {
    text += line(f / 30.0);
    if (f % 20 == 7) text += line(f / 30.0);                 // twice
    if (f == 40) text += line(37 / 30.0) + line(38 / 30.0);  // late
    if (f == 50) text += line(50.5 / 30, 5e8);               // no time of anybody
  }
  const JointRecording got = read(text);
  EXPECT_EQ(got.frames.size(), 60u);
  EXPECT_HAS(all_of(got.remarks), "6 lines are left out: their time does not go on");
  EXPECT_LT(off(solve(got)), 5e-3);
  std::string again;  // the clock began anew
  for (int f = 0; f < 80; ++f) again += line(f / 30.0, f < 40 ? 100 + f / 30.0 : f / 30.0);
  EXPECT_HAS(refused(again), "go back by 99.97 s after line 40");
  std::string same;
  for (int f = 0; f < 40; ++f) same += line(f / 30.0, 3);
  EXPECT_EQ(read(same).fps, 0);
  EXPECT_EQ(read(same).frames.size(), 40u);
}

TEST_F(JointTimes, UnitsTremblingAndUnevenTimes) {
  for (const double unit : {1.0, 1e3, 1e6, 1e9}) {
    std::string text;
    for (int f = 0; f < 60; ++f) text += line(f / 30.0, std::round(unit * 1e3 * f / 30) / 1e3);
    EXPECT_EQ(read(text).fps, 30) << unit;
    EXPECT_EQ(read(text).frames.size(), 60u) << unit;
  }
  std::string trembling, two_rates;
  for (int f = 0; f < 60; ++f) trembling += line(f / 30.0, f / 30.0 + 0.012 * std::sin(40.0 * f));
  EXPECT_NEAR(read(trembling).fps, 30, 0.3);
  EXPECT_EQ(read(trembling).frames.size(), 60u);
  for (int f = 0; f < 120; f += f < 60 ? 1 : 3) two_rates += line(f / 60.0);
  EXPECT_LT(off(solve(read(two_rates))), 5e-3);
  std::string uneven;
  double at = 0;
  for (int f = 0; f < 90; ++f, at += f % 4 == 0 ? 0.05 : f % 4 == 1 ? 0.013 : 0.021)
    uneven += line(at);
  EXPECT_LT(off(solve(read(uneven))), 0.01);
}

TEST_F(JointTimes, BrokenLinesAreLeftOut) {
  std::string text, cut;
  for (int f = 0; f < 40; ++f) text += f == 20 || f == 25 ? "tracker: lost\n" : line(f / 30.0);
  cut = text + line(40 / 30.0).substr(0, 200);
  JointRecording got = read(text);
  EXPECT_EQ(got.frames.size(), 40u);
  EXPECT_HAS(all_of(got.remarks), "2 lines cannot be read");
  EXPECT_HAS(all_of(got.remarks), "jsonl:21: is no valid JSON: 'tracker: lost'");
  got = read(cut);
  EXPECT_EQ(got.frames.size(), 40u);
  EXPECT_HAS(all_of(got.remarks), "the last line is cut");
  EXPECT_HAS(refused("no\nno\n"), "jsonl:1: is no valid JSON: 'no'");
}

TEST_F(JointTimes, TablesWithGaps) {
  std::string text = "time";
  for (const std::string_view name : kJointNames)
    for (const char* axis : {"_x", "_y", "_z"}) text += "," + std::string(name) + axis;
  std::string commas = text;
  std::replace(commas.begin(), commas.end(), ',', ';');
  for (int f = 0; f < 60; ++f) {
    std::string row = format("\n%.4f", f / 30.0);
    for (const Vec3& x : standing_at(f / 30.0))
      row += format(",%.6f,%.6f,%.6f", x.x(), x.y(), x.z());
    if (f < 20 || f >= 28) text += row;
    std::replace(row.begin(), row.end(), ',', ';');
    std::replace(row.begin(), row.end(), '.', ',');
    commas += row;
  }
  const JointRecording got = *find_joint_recording(dir.write("t.csv", text), {});
  EXPECT_EQ(got.fps, 30);
  EXPECT_EQ(got.frames.size(), 60u);
  const std::string bad = dir.write("c.csv", commas);
  EXPECT_HAS(refusal_of([&] { find_joint_recording(bad, {}); }), "not with commas");
}

TEST_F(JointTimes, NothingThatIsKnown) {
  std::string nothing, feet;
  for (int f = 0; f < 40; ++f) {
    nothing += "{\"joints\": [";
    for (int j = 0; j < 22; ++j) nothing += j == 0 ? "[NaN, NaN, NaN]" : ", [0, 0, 0]";
    nothing += "]}\n";
  }
  EXPECT_HAS(refused(nothing), "knows no joint in any of 40 frames");
  JointRecording got;
  for (int f = 0; f < 40; ++f) feet += line(f / 30.0);
  got = read(feet);
  for (FileFrame& frame : got.frames)
    for (auto& x : frame) *x /= 0.3048;
  EXPECT_HAS(refusal_of([&] { solve(got); }), "scale ft");
}

/// Which of our joints the names are.
std::string called_as(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string_view word : joints_detail::named_layout(names).joints)
    out += (out.empty() ? "" : " ") + std::string(word);
  return out;
}

TEST(JointNames, BonesOfCharacters) {
  const std::vector<std::string> mixamo = {
      "Hips",         "Spine",   "Spine1",      "Spine2",    "Neck",     "Head",     "LeftArm",
      "LeftShoulder", "LeftLeg", "LeftForeArm", "LeftUpLeg", "LeftHand", "LeftFoot", "LeftToeBase"};
  const std::string ours =
      "pelvis spine1 spine2 spine3 neck head left_shoulder left_collar left_knee left_elbow "
      "left_hip left_wrist left_ankle left_foot";
  for (const char* before : {"", "mixamorig:", "mixamorig_", "mixamorig9:"}) {
    std::vector<std::string> names;
    for (const std::string& name : mixamo) names.push_back(before + name);
    EXPECT_EQ(called_as(names), ours) << before;
  }
  EXPECT_EQ(called_as({"hips", "spine", "chest", "upperChest", "rightUpperLeg", "rightLowerLeg",
                       "rightFoot", "rightToes", "rightShoulder", "rightUpperArm", "rightLowerArm",
                       "rightHand"}),
            "pelvis spine1 spine2 spine3 right_hip right_knee right_ankle right_foot right_collar "
            "right_shoulder right_elbow right_wrist");
  EXPECT_EQ(
      called_as({"Bip01 Pelvis", "Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot", "Bip01 L Toe0",
                 "Bip01 L Clavicle", "Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand"}),
      "pelvis left_hip left_knee left_ankle left_foot left_collar left_shoulder left_elbow "
      "left_wrist");
}

TEST(JointNames, TrackersWordsStayWhatTheyWere) {
  EXPECT_EQ(called_as({"HandLeft", "WristLeft", "FootLeft", "AnkleLeft", "ShoulderLeft"}),
            "left_hand left_wrist left_foot left_ankle left_shoulder");
  EXPECT_EQ(called_as({"PoseLandmark.LEFT_HIP", "PoseLandmark.LEFT_FOOT_INDEX",
                       "PoseLandmark.LEFT_HEEL", "PoseLandmark.NOSE"}),
            "left_hip left_toe left_heel nose");
  const JointLayout got = joints_detail::named_layout({"LHip", "RHip", "Banana"});
  EXPECT_EQ(got.unknown, (std::vector<std::string>{"Banana"}));
}

}  // namespace
}  // namespace restage
