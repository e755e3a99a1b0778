// CMU clips and BVH files of the data folder against its reference joints.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>

#include "datasets/hdf5/file.h"
#include "datasets/importers/bvh.h"
#include "datasets/importers/cmu.h"
#include "tests/datasets/schema_support.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;

class ImportersCmu : public ::testing::Test {
 protected:
  void SetUp() override { RESTAGE_NEED_DATA(); }
};

const h5::File& clips_file() {
  static const h5::File file = h5::File::open(data_folder() + "/cmu/clips30.h5");
  return file;
}

/// Read once for all tests.
const std::vector<CmuClip>& all_clips() {
  static const std::vector<CmuClip> clips = read_cmu(data_folder() + "/cmu/clips30.h5", true);
  return clips;
}

/// reference22 of a clip, empty if it has none.
std::vector<float> reference(const std::string& clip) {
  const std::string name = "/clips/" + clip + "/reference22";
  if (!clips_file().has(name)) return {};
  return clips_file().read<float>(name, {-1, kJoints, 3});
}

double largest_difference(const std::vector<Joints>& joints, const std::vector<float>& expected) {
  EXPECT_EQ(joints.size() * kJoints * 3, expected.size());
  double worst = 0;
  for (size_t i = 0; i < std::min(joints.size() * kJoints * 3, expected.size()); ++i)
    worst = std::max(worst,
                     std::abs(joints[i / 66][i / 3 % 22][static_cast<int>(i % 3)] - expected[i]));
  return worst;
}

TEST_F(ImportersCmu, AllClipsGiveTheReferenceJoints) {
  const std::vector<CmuClip>& clips = all_clips();
  EXPECT_EQ(clips.size(), 247u);
  size_t compared = 0, frames = 0;
  std::map<std::string, int> splits;
  for (const CmuClip& clip : clips) {
    ++splits[clip.motion.split];
    frames += clip.motion.frames();
    const std::vector<float> expected = reference(clip.motion.id);
    if (expected.empty()) continue;
    ++compared;
    EXPECT_LT(largest_difference(clip.joints, expected), 1e-5) << clip.motion.id;
  }
  EXPECT_EQ(compared, 169u);
  EXPECT_NEAR(static_cast<double>(frames) / 30, 2928, 5);
  EXPECT_EQ(splits["train"], 177);
  EXPECT_EQ(splits["validation"], 20);
  EXPECT_EQ(splits["test"], 50);
}

TEST_F(ImportersCmu, RestAndFloorAreThoseOfTheFile) {
  for (const CmuClip& clip : all_clips()) {
    const std::string group = "/clips/" + clip.motion.id;
    const std::string skeleton = *clips_file().text(group, "skeleton");
    const auto rest = clips_file().read<double>("/skeletons/" + skeleton + "/rest22", {kJoints, 3});
    for (int j = 0; j < kJoints; ++j)
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(clip.motion.rest[j][k], rest[static_cast<size_t>(3 * j + k)], 1e-6)
            << skeleton << j;
    const Joints& first = clip.joints[0];
    const double hips =
        0.5 * (first[1].y() + first[2].y()) - *clips_file().number(group, "floor_y");
    ASSERT_NEAR(clip.motion.hips[0].y(), hips, 1e-6);
  }
}

/// Imports the part of a BVH file that a clip of clips30.h5 was made from.
MotionClip part_of(const std::string& path, const std::string& clip) {
  const std::string group = "/clips/" + clip;
  MotionOptions options;
  options.drop_leading = static_cast<int>(*clips_file().number(group, "source_first_frame"));
  options.keep_frames = static_cast<size_t>(*clips_file().number(group, "source_frames"));
  options.fps = *clips_file().number(group, "source_fps");
  return read_bvh(path, options);
}

TEST_F(ImportersCmu, BvhFilesGiveTheReferenceJoints) {
  size_t compared = 0;
  for (const std::string& clip : clips_file().children("/clips")) {
    const bool has_part = clip.find_first_of("abcdefgh", 2) != std::string::npos;
    const std::string file = data_folder() + "/cmu/bvh/" +
                             (has_part ? clip.substr(0, clip.size() - 1) : clip) + ".bvh.xz";
    const std::vector<float> expected = reference(clip);
    if (expected.empty() || !fs::exists(file) ||
        *clips_file().text("/clips/" + clip, "skeleton") != "daz")
      continue;  // the others' references are of the ASF skeletons
    ++compared;
    const MotionClip bvh = part_of(file, clip);
    EXPECT_LT(largest_difference(bvh.joints, expected), 2e-4) << clip;
    EXPECT_NEAR(bvh.floor_y, *clips_file().number("/clips/" + clip, "floor_y"), 2e-4) << clip;
    EXPECT_DOUBLE_EQ(bvh.scale, 0.01);
  }
  EXPECT_GE(compared, 15u);
}

TEST_F(ImportersCmu, TheRuleForLeadingFramesIsThatOfTheClips) {
  const MotionClip bvh = read_bvh(data_folder() + "/cmu/bvh/07_01.bvh.xz");
  EXPECT_LT(largest_difference(bvh.joints, reference("07_01")), 2e-4);
  EXPECT_EQ(bvh.motion.id, "07_01");
  EXPECT_EQ(bvh.motion.subject, "07");
}

TEST_F(ImportersCmu, OriginalSkeletonIsTheAsfOne) {
  MotionOptions options;
  options.drop_leading = 1;  // a T-pose before the frames of the ASF/AMC file
  options.keep_frames = 2751;
  const MotionClip bvh =
      read_bvh(data_folder() + "/cmu/bvh_original_skeleton/01_01.bvh.xz", options);
  const std::vector<CmuClip>& clips = all_clips();
  const auto clip = std::find_if(clips.begin(), clips.end(),
                                 [](const CmuClip& c) { return c.motion.id == "01_01"; });
  ASSERT_NE(clip, clips.end());
  ASSERT_EQ(bvh.motion.frames(), clip->motion.frames());
  // The file has another person's bone lengths: directions at rest and rotations are compared.
  for (const auto& limb :
       {std::array{1, 4}, {2, 5}, {4, 7}, {5, 8}, {16, 18}, {17, 19}, {18, 20}, {19, 21}}) {
    const Vec3 a = bvh.motion.rest[limb[1]] - bvh.motion.rest[limb[0]];
    const Vec3 b = clip->motion.rest[limb[1]] - clip->motion.rest[limb[0]];
    EXPECT_LT((a.normalized() - b.normalized()).norm(), 0.01) << limb[0];
  }
  double worst = 0;
  for (size_t f = 0; f < bvh.joints.size(); ++f)
    for (int j = 0; j < kJoints; ++j)
      worst = std::max<double>(worst,
                               bvh.motion.global[f][j].angularDistance(clip->motion.global[f][j]));
  EXPECT_LT(worst, 2e-3);
}

TEST_F(ImportersCmu, ForeignFiles) {
  const std::string folder = data_folder() + "/foreign/";
  for (const char* name : {"pymo_walk_meredith", "makehuman_walk1", "makehuman_zombiewalk1",
                           "makehuman_dance1", "makehuman_benchmark"}) {
    const MotionClip clip = read_bvh(folder + name + ".bvh.xz");
    const Joints& rest = clip.motion.rest;
    EXPECT_GT(rest[16].x(), 0.08) << name;  // left is +x
    EXPECT_LT(rest[17].x(), -0.08) << name;
    EXPECT_GT(rest[15].y(), 0.4) << name;                 // the head is up
    EXPECT_GT(rest[10].z(), rest[7].z() + 0.05) << name;  // toes in front
    const double leg = leg_length(rest);
    EXPECT_GT(leg, 0.6) << name;
    EXPECT_LT(leg, 1.1) << name;
    if (std::string(name) == "makehuman_benchmark") continue;  // a pose of no particular kind
    for (const Point& hips : clip.motion.hips) {
      EXPECT_GT(hips.y(), 0.4 * leg) << name;
      EXPECT_LT(hips.y(), 1.3 * leg + 0.15) << name;
    }
  }
  EXPECT_EQ(read_bvh(folder + "makehuman_walk1.bvh.xz").motion.frames(), 17u);      // 13 / 24 s
  EXPECT_EQ(read_bvh(folder + "pymo_walk_meredith.bvh.xz").motion.frames(), 266u);  // 1063 / 120 s
  EXPECT_HAS(error_of([&] { read_bvh(folder + "fairmotion_sinusoidal.bvh.xz"); }), "lacks");
}

TEST_F(ImportersCmu, BrokenRootIsRefused) {
  EXPECT_HAS(error_of([&] { read_bvh(data_folder() + "/cmu/bvh/07_12.bvh.xz"); }), "root jumps");
}

}  // namespace
}  // namespace restage
