// Frames of a source that are missing.
#include <gtest/gtest.h>

#include "tests/infer/retargeter_support.h"

namespace restage {
namespace {

using namespace retargeter_test;

/// Pushes the source but for some frames, which are missed.
std::vector<RetargetedFrame> with_gaps(Retargeter& r, const std::vector<Joints>& source,
                                       const std::vector<size_t>& missed) {
  std::vector<RetargetedFrame> out;
  const auto keep = [&](std::span<const RetargetedFrame> frames) {
    out.insert(out.end(), frames.begin(), frames.end());
  };
  for (size_t f = 0; f < source.size(); ++f)
    if (std::find(missed.begin(), missed.end(), f) != missed.end())
      r.miss();
    else
      keep(pushed_joints(r, source[f]));
  keep(finished(r));
  return out;
}

std::vector<size_t> filled(const std::vector<RetargetedFrame>& frames) {
  std::vector<size_t> out;
  for (size_t f = 0; f < frames.size(); ++f)
    if (frames[f].filled) out.push_back(f);
  return out;
}

using Numbers = std::vector<size_t>;

TEST(InferRetargeter, MissedFramesLieBetweenThoseAround) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(20);
  std::vector<Joints> bridged = source;
  for (size_t j = 0; j < kJoints; ++j) {
    bridged[7][j] = (2 * source[6][j] + source[9][j]) / 3;
    bridged[8][j] = (source[6][j] + 2 * source[9][j]) / 3;
  }
  Retargeter r(models, "w", target().rest, target().joints, {});
  const auto expected = retargeted(models, bridged), found = with_gaps(r, source, {7, 8});
  ASSERT_EQ(found.size(), source.size());
  for (size_t f = 0; f < found.size(); ++f)
    EXPECT_LT(apart(*found[f].joints, *expected[f].joints), 1e-6) << f;
  EXPECT_EQ(filled(found), (Numbers{7, 8}));
  r.restart();
  EXPECT_EQ(filled(with_gaps(r, source, {})), Numbers{}) << "a restart forgets the gaps";
}

TEST(InferRetargeter, GapsAtTheEndsRepeatTheNearestFrame) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(8);
  std::vector<Joints> repeated = source;
  repeated[0] = repeated[1] = source[2];
  repeated[6] = repeated[7] = source[5];
  const auto expected = retargeted(models, repeated);
  Retargeter r(models, "w", target().rest, target().joints, {});
  const auto found = with_gaps(r, source, {0, 1, 6, 7});
  ASSERT_EQ(found.size(), 8u);
  for (size_t f = 0; f < 8; ++f) EXPECT_EQ(apart(*found[f].joints, *expected[f].joints), 0) << f;
  EXPECT_EQ(filled(found), (Numbers{0, 1, 6, 7}));
  r.restart();
  EXPECT_TRUE(with_gaps(r, source, {0, 1, 2, 3, 4, 5, 6, 7}).empty());
}

TEST(InferRetargeter, GapsInSourcesOfOtherRatesAndOfNetworksThatLookAhead) {
  const std::vector<Joints> source = performance(40);
  const auto gaps = [&](const Bundle& models, double fps, const Numbers& missed) {
    Retargeter r(models, "w", target().rest, target().joints, {.fps = fps});
    return with_gaps(r, source, missed);
  };
  const Bundle models = untrained();
  // Of 60 frames a second every second one is of the result.
  auto frames = gaps(models, 60, {11});
  EXPECT_EQ(frames.size(), 20u);
  EXPECT_EQ(filled(frames), Numbers{});
  frames = gaps(models, 60, {11, 12, 13, 39});
  EXPECT_EQ(frames.size(), 20u);
  EXPECT_EQ(filled(frames), Numbers{6});
  frames = gaps(models, 15, {4});
  EXPECT_EQ(frames.size(), 79u);
  EXPECT_EQ(filled(frames), (Numbers{7, 8, 9}));
  const Bundle late = testing::untrained_bundle("smrm/hybrid", {"hidden=8", "latency=3"});
  frames = gaps(late, 30, {5, 38, 39});
  EXPECT_EQ(frames.size(), 40u);
  EXPECT_EQ(filled(frames), (Numbers{5, 38, 39}));
}

TEST(InferRetargeter, NobodyIsSureOfAFilledFrame) {
  const auto source = performance(kReturnFrames + 12);
  Retargeter r(untrained(), "w", target().rest, target().joints, {.min_confidence = 0.5});
  std::vector<RetargetedFrame> frames;
  for (size_t f = 0; f < source.size(); ++f) {
    if (f == 5 || f == 6) {
      r.miss();
      continue;
    }
    SeenJoints seen = source[f];
    seen.uncertainty.emplace().fill(0.002);
    for (const RetargetedFrame& frame : pushed_joints(r, seen)) frames.push_back(frame);
  }
  ASSERT_EQ(frames.size(), source.size());
  for (const size_t f : {5u, 6u}) {
    EXPECT_EQ(frames[f].confidence, 0) << f;
    EXPECT_EQ(apart(*frames[f].joints, *frames[4].joints), 0) << f << ": the target waits";
  }
  EXPECT_GT(*frames[7].confidence, 0.9);
}

}  // namespace
}  // namespace restage
