// Joints that come line by line: what a line says, and the poses that are found one by one.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "autograd/base/format.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/importers/joints/follow.h"
#include "datasets/importers/joints/joint_lines.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/readers/errors.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using namespace test;

constexpr size_t kLearn = 30;

class JointStream : public ::testing::Test {
 protected:
  using Place = std::function<Vec3(const Vec3&)>;
  /// Where a built-in motion's joints are; it walks along z.
  static std::vector<Joints> walk(size_t frames = 60) {
    static const Motion motion = builtin_motion(3, "test", 1);
    const Joints rest = builtin_rest_joints();
    std::vector<Joints> out;
    for (size_t f = 0; f < frames; ++f) {
      Rotations global;
      for (size_t j = 0; j < kJoints; ++j)
        global[j] =
            motion.global[f % motion.frames()][j].cast<double>().normalized().toRotationMatrix();
      const Vec3 hips = motion.hips[f % motion.frames()].cast<double>();
      const Vec3 root = hips + global[0] * (rest[0] - 0.5 * (rest[1] + rest[2]));
      out.push_back(forward_kinematics(rest, {to_local(global), root}).joints);
    }
    return out;
  }
  static JointRecording recording(
      const std::vector<Joints>& frames, size_t count,
      const Place& place = [](const Vec3& x) { return x; }) {
    JointRecording out;
    out.layout = joint_layout("smpl22");
    out.fps = kFps;
    for (size_t f = 0; f < std::min(count, frames.size()); ++f) {
      out.frames.emplace_back();
      for (const Vec3& x : frames[f]) out.frames.back().push_back(place(x));
    }
    return out;
  }
  static JointFollower follower(const JointRecording& all, ImportReport* report = nullptr) {
    JointRecording first = all;
    first.frames.resize(std::min(kLearn, all.frames.size()));
    ImportReport mine;
    return JointFollower(first, {}, report != nullptr ? *report : mine);
  }
  /// The largest distance of a joint from the truth, but for a lift of all, metres.
  static double farthest(const PosedSkeleton& found, const Joints& truth) {
    const Vec3 lift(0, truth[0].y() - found.joints[0].y(), 0);
    double out = 0;
    for (size_t j = 0; j < kJoints; ++j)
      out = std::max(out, (found.joints[j] + lift - truth[j]).norm());
    return out;
  }
};

TEST_F(JointStream, EveryJointIsWhereItIsSeen) {
  const auto truth = walk();
  const JointRecording all = recording(truth, truth.size());
  JointFollower one_by_one = follower(all);
  ASSERT_EQ(one_by_one.first().size(), kLearn);
  for (size_t f = kLearn; f < truth.size(); ++f) {
    const auto found = one_by_one.next(all.frames[f]);
    ASSERT_TRUE(found);
    EXPECT_LT(farthest(*found, truth[f]), 2e-3) << f;
  }
}

TEST_F(JointStream, TurnsAreNearlyThoseOfTheWholeRecording) {
  const auto truth = walk();
  const JointRecording all = recording(truth, truth.size());
  ImportReport report;
  const Motion late = solve_joints(all, {}, report).motion;
  JointFollower one_by_one = follower(all);
  double sum = 0, most = 0;
  for (size_t f = kLearn; f < truth.size(); ++f) {
    const auto found = one_by_one.next(all.frames[f]);
    for (size_t j = 0; j < kJoints; ++j) {
      const double angle = Quat(found->global[j]).angularDistance(late.global[f][j].cast<double>());
      sum += angle / kJoints / static_cast<double>(truth.size() - kLearn);
      most = std::max(most, angle);
    }
  }
  EXPECT_LT(sum, 3 * M_PI / 180);
  EXPECT_LT(most, 35 * M_PI / 180);
}

TEST_F(JointStream, AxesAndUnitsAreLearntFromTheFirstSecond) {
  const auto truth = walk();
  const JointRecording all = recording(
      truth, truth.size(), [](const Vec3& x) { return Vec3(1e3 * Vec3(x.x(), -x.z(), x.y())); });
  ImportReport report;
  JointFollower one_by_one = follower(all, &report);
  std::string said;
  for (const auto& [name, value] : report.facts) said += cat(name, " ", value, "\n");
  EXPECT_HAS(said, "up z");
  EXPECT_HAS(said, "millimetres");
  EXPECT_EQ(said.find("frame rate"), said.npos);
  for (size_t f = kLearn; f < truth.size(); ++f)
    EXPECT_LT(farthest(*one_by_one.next(all.frames[f]), truth[f]), 2e-3) << f;
}

TEST_F(JointStream, WhatIsMissingGoesWithTheTrunkForAWhile) {
  const auto truth = walk(70);
  JointRecording all = recording(truth, truth.size());
  JointFollower one_by_one = follower(all);
  for (size_t f = kLearn; f < truth.size(); ++f) {
    all.frames[f][kLeftWrist].reset();
    all.frames[f][kRightHip].reset();
    all.frames[f][kRightShoulder].reset();
    const auto found = one_by_one.next(all.frames[f]);
    ASSERT_TRUE(found) << f;
    if (f == kLearn) {
      EXPECT_LT(farthest(*found, truth[f]), 0.05);
    }
    // Bones keep their lengths, and nobody is torn apart.
    for (size_t j = 1; j < kJoints; ++j) {
      const auto p = static_cast<size_t>(kParents[j]);
      EXPECT_NEAR((found->joints[j] - found->joints[p]).norm(),
                  (one_by_one.rest()[j] - one_by_one.rest()[p]).norm(), 1e-9);
    }
    EXPECT_LT((found->joints[kPelvis] - truth[f][kPelvis]).norm(), 0.15) << f;
  }
}

TEST_F(JointStream, TheFloorGoesDownToWhoStepsDown) {
  const auto truth = walk(150);
  JointRecording all = recording(truth, truth.size());
  for (size_t f = 0; f < 45; ++f)  // on a box
    for (auto& x : all.frames[f]) *x += Vec3(0, 0.5, 0);
  JointFollower one_by_one = follower(all);
  double before = 0, fastest = 0;
  int sank = 0;
  for (size_t f = kLearn; f < truth.size(); ++f) {
    const auto found = one_by_one.next(all.frames[f]);
    ASSERT_TRUE(found);
    sank += one_by_one.floor_sinks() > 0;
    const double up = found->joints[0].y() - truth[f][0].y();  // of the found floor
    if (f > 46) fastest = std::max(fastest, up - before);
    before = up;
    if (f == 60) {
      EXPECT_LT(up, -0.3) << "a jump or a squat moves no floor";
    }
  }
  EXPECT_EQ(sank, 1);
  EXPECT_NEAR(before, 0, 0.06);
  EXPECT_LT(fastest, 0.15) << "smoothly";
}

TEST_F(JointStream, MomentsThatAreMissingAreNoHipsThatAreNotKnown) {
  const auto truth = walk();
  JointRecording first = recording(truth, kLearn);
  for (size_t f = 1; f < kLearn; ++f)
    if (f % 3 != 0) first.frames[f].assign(kJoints, std::nullopt);
  ImportReport report;
  follower(first, &report);
  for (const std::string& remark : report.remarks) EXPECT_EQ(remark.find("hip"), remark.npos);
}

TEST_F(JointStream, WithoutATrunkThereIsNothing) {
  const auto truth = walk();
  JointRecording all = recording(truth, truth.size());
  JointFollower one_by_one = follower(all);
  EXPECT_FALSE(one_by_one.next({}));
  FileFrame only_a_hand(22);
  only_a_hand[kLeftWrist] = Vec3(1, 1, 1);
  EXPECT_FALSE(one_by_one.next(only_a_hand));
  FileFrame nowhere(22, Vec3(1, 1, 1));
  EXPECT_FALSE(one_by_one.next(nowhere));
  FileFrame too_far = all.frames[kLearn];
  for (auto& x : too_far) *x += Vec3(1e30, 0, 0);
  EXPECT_FALSE(one_by_one.next(too_far));
  for (size_t f = kLearn + 4; f < truth.size(); ++f)
    EXPECT_LT(farthest(*one_by_one.next(all.frames[f]), truth[f]), 2e-3) << f;
  one_by_one.restart();
  FileFrame no_hip = all.frames[40];
  no_hip[kLeftHip].reset();
  EXPECT_FALSE(one_by_one.next(no_hip));  // what was seen before the gap says nothing
  EXPECT_LT(farthest(*one_by_one.next(all.frames[40]), truth[40]), 2e-3);
}

TEST_F(JointStream, AJointThatStraysIsNotBelieved) {
  const auto truth = walk();
  JointRecording all = recording(truth, truth.size());
  JointFollower one_by_one = follower(all);
  for (size_t f = kLearn; f < kLearn + 5; ++f) {
    all.frames[f][kRightWrist] = Vec3(40, 2, 3);
    EXPECT_LT(farthest(*one_by_one.next(all.frames[f]), truth[f]), 0.1) << f;
  }
}

TEST_F(JointStream, BonesAreThoseOfTheFirstSecond) {
  const auto truth = walk();
  const JointRecording all = recording(truth, truth.size());
  JointFollower one_by_one = follower(all);
  const Joints rest = one_by_one.rest();
  const JointRecording larger =
      recording(truth, truth.size(), [](const Vec3& x) { return Vec3(1.1 * x); });
  for (size_t f = kLearn; f < truth.size(); ++f) {
    const PosedSkeleton found = *one_by_one.next(larger.frames[f]);
    for (const int j : {kLeftKnee, kRightWrist, kNeck}) {
      const auto at = static_cast<size_t>(j), p = static_cast<size_t>(kParents[at]);
      EXPECT_NEAR((found.joints[at] - found.joints[p]).norm(), (rest[at] - rest[p]).norm(), 1e-9);
    }
  }
}

TEST_F(JointStream, JointsRelativeToTheRootStandOnTheLowerFoot) {
  const auto truth = walk();
  JointRecording all;
  all.layout = joint_layout("smpl22");
  for (const Joints& joints : truth) {
    all.frames.emplace_back();
    for (const Vec3& x : joints) all.frames.back().push_back(x - joints[kPelvis]);
  }
  ImportReport report;
  JointFollower one_by_one = follower(all, &report);
  ASSERT_EQ(report.remarks.size(), 1u);
  EXPECT_HAS(report.remarks[0], "stands on the lower foot");
  for (size_t f = kLearn; f < truth.size(); ++f)
    EXPECT_NEAR(lowest_foot(*one_by_one.next(all.frames[f])), 0, 1e-9);
}

TEST_F(JointStream, ShortOrUselessBeginningsAreRefused) {
  const auto truth = walk(3);
  EXPECT_NO_THROW(follower(recording(truth, 3)));
  JointRecording exchanged =
      recording(walk(40), 40, [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); });
  EXPECT_HAS(refusal_of([&] { follower(exchanged); }), "point backwards");
}

// ---- lines --------------------------------------------------------------------------------------

std::string list_of(const Joints& joints) {
  std::string out;
  for (const Vec3& x : joints)
    out += cat(out.empty() ? "" : ", ", format("[%.9f, %.9f, %.9f]", x.x(), x.y(), x.z()));
  return "[" + out + "]";
}

TEST_F(JointStream, LinesSayWhereJointsAre) {
  JointLines lines({});
  const JointLine list =
      lines.read(R"({"time": 1.5, "joints": [[0, 0, 0], null, [1, 2, 3], [NaN, 1, 2], [0, 0, 0],
                     [1, 2, 3, 0], [4, 5, 6, 0.5]]})",
                 "here:1");
  ASSERT_EQ(list.people.size(), 1u);
  const FileFrame& got = list.people.at(0);
  EXPECT_EQ(list.seconds, 1.5);
  ASSERT_EQ(got.size(), 7u);
  EXPECT_TRUE(got[0] && !got[1] && got[2] && !got[3] && !got[4] && !got[5] && got[6]);
  EXPECT_EQ(*got[6], Vec3(4, 5, 6));
  const JointLine bare = lines.read("[null, [1, 2, 3], [1, 2, 1e308], [-1e300, 1e300, 2]]", "h:2");
  EXPECT_FALSE(bare.seconds);
  EXPECT_TRUE(bare.people.at(0)[1] && !bare.people.at(0)[2] && !bare.people.at(0)[3]);
  EXPECT_EQ(lines.read(R"({"timestamp_usec": 2500000, "joints": [[1, 2, 3]]})", "h").seconds, 2.5);
  const JointLine two = lines.read(
      R"({"bodies": [{"body_id": 7, "joints": [[1, 2, 3]]}, {"body_id": 4, "joints": [[4, 5, 6]]}]})",
      "here:3");
  EXPECT_EQ(*two.people.at(7)[0], Vec3(1, 2, 3));
  EXPECT_EQ(*two.people.at(4)[0], Vec3(4, 5, 6));
}

TEST_F(JointStream, BrokenLinesSayWhere) {
  JointLines lines({});
  for (const auto& [line, words] :
       {std::pair(R"({"time": 1, "joints": [[1, 2)", "here:4: is no valid JSON"),
        {R"({"time": "now", "joints": [[1, 2, 3]]})", "a time that is no number"},
        {R"({"joints": [null, null]})", "shows nobody's joints"},
        {R"({"joints": "none"})", "shows nobody's joints"},
        {R"({"joints": {}})", "shows nobody's joints"},
        {R"({"joints": [[1, 2], [3, 4]]})", "two numbers a joint"},
        {"[]", "shows nobody's joints"},
        {"7", "shows nobody's joints"}})
    EXPECT_HAS(refusal_of([&, text = line] { lines.read(text, "here:4"); }), words) << line;
  EXPECT_HAS(refusal_of([&] { lines.read(std::string(100000, '['), "here:4"); }), "no valid JSON");
  lines.read("[[1, 2, 3]]", "here:5");
  EXPECT_HAS(refusal_of([] {
               JointLines({}).read(R"([{"joints": {"head": [1, 2, 3]}}, {"joints": [[1, 2, 3]]}])",
                                   "h");
             }),
             "by names and others not");
  EXPECT_HAS(refusal_of([&] { lines.read(R"({"joints": {"head": [1, 2, 3]}})", "here:6"); }),
             "here:6: calls joints by names, and the lines before do not");
}

TEST_F(JointStream, AnyBytesAreALineOrRefused) {
  const auto truth = walk(1);
  const std::string line = cat(R"({"time": 1, "bodies": [{"body_id": 3, "joints": )",
                               list_of(truth[0]), R"(}, {"joints": [[1, 2, 3], null]}]})");
  Rng rng(RngKey{1, 0});
  JointFileOptions options;
  options.person = "0";
  int taken = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string changed = line;
    for (int k = 0; k <= round % 2; ++k)
      changed[rng.below(changed.size())] = "0[]{},:\"-e9x"[rng.below(13)];
    try {
      JointLines lines(options);
      const JointLine got = lines.read(changed, "here");
      ++taken;
      const JointRecording first = lines.learn({got, got}, "here");
      follower(first);
    } catch (const InputError&) {
    }
  }
  EXPECT_GT(taken, 10);
}

TEST_F(JointStream, NamesMayComeLater) {
  const auto truth = walk(3);
  JointLines lines({});
  std::vector<JointLine> first;
  for (size_t f = 0; f < 3; ++f) {
    std::string named;
    for (size_t j = 0; j < kJoints; ++j)
      if (j != kHead || f == 2)
        named +=
            cat(named.empty() ? "" : ", ", "\"", kJointNames[j], "\": ",
                format("[%.9f, %.9f, %.9f]", truth[f][j].x(), truth[f][j].y(), truth[f][j].z()));
    first.push_back(lines.read("{\"joints\": {" + named + "}}", "here"));
  }
  const JointRecording all = lines.learn(first, "here");
  EXPECT_EQ(all.layout.joints.size(), 22u);
  const MappedFrame early = mapped(all.frames[0], all.layout),
                    late = mapped(all.frames[2], all.layout);
  EXPECT_FALSE(early.joints[kHead]);
  EXPECT_LT((*late.joints[kHead] - truth[2][kHead]).norm(), 1e-8);
  EXPECT_LT((*early.joints[kLeftKnee] - truth[0][kLeftKnee]).norm(), 1e-8);
  EXPECT_EQ(lines.names(), 22u);
  JointLines strange({});
  const std::vector<JointLine> unknown = {strange.read(R"({"joints": {"a": [1, 2, 3]}})", "here")};
  EXPECT_HAS(refusal_of([&] { strange.learn(unknown, "here"); }), "both hips and both shoulders");
}

TEST_F(JointStream, OneOfSeveralPeopleIsFollowed) {
  const auto truth = walk(3);
  std::vector<JointLine> first;
  const auto read = [&](JointLines& lines) {
    first.clear();
    for (const Joints& joints : truth) {
      Joints far = joints;
      for (Vec3& x : far) x += Vec3(4, 0, 0);
      first.push_back(lines.read(cat(R"({"bodies": [{"body_id": 3, "joints": )", list_of(far),
                                     R"(}, {"body_id": 9, "joints": )", list_of(joints), "}]}"),
                                 "here"));
    }
  };
  const auto x_of = [&](const std::string& person) {
    JointFileOptions options;
    options.person = person;
    JointLines lines(options);
    read(lines);
    const JointRecording found = lines.learn(first, "here");
    EXPECT_EQ(lines.of_person(first[1], "here").size(), 22u);
    JointLine nobody;
    EXPECT_TRUE(lines.of_person(nobody, "here").empty());
    JointLine fewer = first[1];
    fewer.people[3].pop_back(), fewer.people[9].pop_back();
    EXPECT_HAS(refusal_of([&] { lines.of_person(fewer, "here"); }), "has 21 joints");
    return found.frames[0][0]->x() - truth[0][0].x();
  };
  EXPECT_NEAR(x_of("0"), 4, 1e-6);
  EXPECT_NEAR(x_of("1"), 0, 1e-6);
  EXPECT_NEAR(x_of("nearest"), 0, 1e-6);
  EXPECT_HAS(refusal_of([&] { x_of("2"); }), "no number '2'");
  EXPECT_HAS(refusal_of([&] { x_of(""); }), "2 people");
}

}  // namespace
}  // namespace restage
