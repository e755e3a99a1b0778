#include "infer/waiting.h"

#include <gtest/gtest.h>

#include "tests/infer/toy_body.h"

namespace restage {
namespace {

using testing::toy_body;
using testing::toy_pose;

double pose_gap(const Pose& a, const Pose& b) {
  double most = (a.root - b.root).norm();
  for (size_t j = 0; j < kJoints; ++j) most = std::max(most, (a.local[j] - b.local[j]).norm());
  return most;
}

Pose walk(int frame) { return toy_pose(toy_body(), frame / 30.0); }

/// What is shown of a walk whose frames [from, to) are not believed.
std::vector<Pose> shown(int frames, int from, int to) {
  Waiting waiting;
  std::vector<Pose> out;
  for (int f = 0; f < frames; ++f)
    out.push_back(f >= from && f < to ? waiting.wait(walk(0)) : waiting.go_on(walk(f)));
  return out;
}

TEST(Waiting, IsNotNoticedWhereEveryFrameIsBelieved) {
  const auto poses = shown(30, 0, 0);
  for (int f = 0; f < 30; ++f) EXPECT_EQ(pose_gap(poses[f], walk(f)), 0) << f;
}

TEST(Waiting, HoldsAndComesBackWithoutAJump) {
  constexpr int kFrom = 10, kTo = 20, kFrames = 60;
  const auto poses = shown(kFrames, kFrom, kTo);
  for (int f = kFrom; f < kTo; ++f) EXPECT_EQ(pose_gap(poses[f], poses[kFrom - 1]), 0) << f;
  const double jump = pose_gap(walk(kTo), walk(kFrom - 1));  // what it would be
  double usual = 0;                                          // step of the walk
  for (int f = 1; f < kFrames; ++f) usual = std::max(usual, pose_gap(walk(f), walk(f - 1)));
  ASSERT_GT(jump, 3 * usual);
  // Also while the walk turns round and round.
  for (int f = kTo; f < kFrames; ++f)
    EXPECT_LT(pose_gap(poses[f], poses[f - 1]), usual + 0.15 * jump) << f;
  EXPECT_LT(pose_gap(poses[kTo], poses[kTo - 1]), 0.05 * jump) << "it starts gently";
  EXPECT_GT(pose_gap(poses[kTo + kReturnFrames - 1], walk(kTo + kReturnFrames - 1)), 0);
  for (int f = kTo + kReturnFrames; f < kFrames; ++f)
    EXPECT_EQ(pose_gap(poses[f], walk(f)), 0) << f;
  for (const Pose& pose : poses)
    for (const Mat3& r : pose.local) EXPECT_LT((r * r.transpose() - Mat3::Identity()).norm(), 1e-6);
}

TEST(Waiting, DoubtOnTheWayBackHoldsWhatWasShown) {
  Waiting waiting;
  waiting.go_on(walk(0));
  waiting.wait(walk(0));
  for (int f = 5; f < 12; ++f) waiting.go_on(walk(f));
  const Pose halfway = waiting.go_on(walk(12));
  EXPECT_EQ(pose_gap(waiting.wait(walk(0)), halfway), 0);
  EXPECT_LT(pose_gap(waiting.go_on(walk(14)), halfway), 0.1 * pose_gap(walk(14), halfway));
}

TEST(Waiting, BeginsAtRest) {
  Waiting waiting;
  EXPECT_EQ(pose_gap(waiting.wait(walk(7)), walk(7)), 0);
  EXPECT_EQ(pose_gap(waiting.wait(walk(9)), walk(7)), 0) << "and stays there";
}

}  // namespace
}  // namespace restage
