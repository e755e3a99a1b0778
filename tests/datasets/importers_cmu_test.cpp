// ASF/AMC: a toy written by the test with bones of any frame. And CMU's clips, BVH and AMC files of
// the data folder against its reference joints.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "datasets/hdf5/file.h"
#include "datasets/importers/import.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/motions/cmu.h"
#include "datasets/readers/skeletons/asf.h"
#include "tests/datasets/importers_support.h"
#include "tests/support/data_folder.h"
#include "tests/support/files.h"
#include "tests/support/toy_asf.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using namespace asf_test;
using ImportersAmc = FileTest;

class ImportersCmu : public ::testing::Test {
 protected:
  void SetUp() override { RESTAGE_NEED_DATA(); }
};

/// Where the bones of a frame begin, by the definition of the format.
std::map<std::string, Vec3> starts(int f) {
  std::map<std::string, Mat3> turn = {
      {"root", about(2, -3.0) * about(1, 20.0 + 0.1 * f) * about(0, 5.0)}};
  std::map<std::string, Vec3> rest_end = {{"root", Vec3::Zero()}},
                              end = {{"root", Vec3(0.01 * f, 0.95, 0.002 * f)}}, out = end;
  for (size_t b = 0; b < toy().size(); ++b) {
    const ToyBone& bone = toy()[b];
    const Vec3 a = axis_of(b);
    const Mat3 c = about(2, a.z()) * about(1, a.y()) * about(0, a.x());
    Mat3 m = Mat3::Identity();
    for (size_t d = 0; d < freedoms(b).size(); ++d)
      m = about(freedoms(b)[d] - 'x', angle(b, static_cast<int>(d), f)) * m;
    turn[bone.name] = turn[bone.parent] * c * m * c.transpose();
    out[bone.name] = end[bone.parent];
    end[bone.name] = end[bone.parent] + turn[bone.name] * (bone.end - rest_end[bone.parent]);
    rest_end[bone.name] = bone.end;
  }
  return out;
}

TEST_F(ImportersAmc, NamesInUtf8StayThemselves) {
  const auto renamed = [](std::string text) {
    for (size_t at = 0; (at = text.find("lwrist", at)) != std::string::npos;)
      text.replace(at, 6, "左手首");
    return text;
  };
  const AsfFile skeleton = parse_asf(renamed(asf_text()), "x.asf");
  EXPECT_TRUE(std::any_of(skeleton.bones.begin(), skeleton.bones.end(),
                          [](const AsfBone& bone) { return bone.name == "左手首"; }));
  MotionOptions told;
  told.fps = 30;
  const MotionClip clip =
      convert_amc(renamed(amc_text(9)), "x.amc", renamed(asf_text()), "x.asf", told);
  EXPECT_EQ(clip.motion.frames(), 9u);
}

TEST_F(ImportersAmc, AToyOfAnyFramesAndFreedomsIsReadExactly) {
  const MotionClip clip = convert_amc(amc_text(121), "a/07_01.amc", asf_text(), "a/07.asf");
  EXPECT_EQ(clip.motion.id, "07_01");
  EXPECT_EQ(clip.motion.subject, "07");
  EXPECT_NEAR(clip.scale, kToyUnit, 1e-12);
  ASSERT_EQ(clip.joints.size(), 31u);
  const std::map<int, std::string> bones = {
      {0, "root"},     {1, "lfemur"},     {2, "rfemur"},     {3, "upperback"}, {4, "ltibia"},
      {5, "rtibia"},   {6, "thorax"},     {7, "lfoot"},      {8, "rfoot"},     {10, "ltoes"},
      {11, "rtoes"},   {12, "upperneck"}, {13, "lclavicle"}, {15, "head"},     {16, "lhumerus"},
      {18, "lradius"}, {20, "lhand"},     {21, "rhand"}};
  for (size_t f = 0; f < clip.joints.size(); ++f) {
    const auto truth = starts(static_cast<int>(4 * f));
    for (const auto& [joint, bone] : bones)
      ASSERT_LT((clip.joints[f][static_cast<size_t>(joint)] - truth.at(bone)).norm(), 1e-6)
          << f << bone;
  }
}

TEST_F(ImportersAmc, RadiansAndGivenRate) {
  std::string asf = asf_text(), amc = amc_text(9);
  MotionOptions options;
  options.fps = 60;
  EXPECT_EQ(convert_amc(amc, "x.amc", asf, "x.asf", options).motion.frames(), 5u);
  amc = replaced(amc, ":DEGREES", ":RADIANS");
  const AsfFile skeleton = parse_asf(asf, "x.asf");
  EXPECT_TRUE(parse_amc(amc, "x.amc", skeleton).radians);
  EXPECT_EQ(skeleton.bones.size(), toy().size() + 1);
  EXPECT_EQ(skeleton.bones[1].limits.size(), 3u);
}

TEST_F(ImportersAmc, BadFilesAreNamedWithTheirLine) {
  const std::string asf = asf_text(), amc = amc_text(5);
  /// The first `from` of the skeleton or of the recording becomes `to`.
  struct Case {
    bool skeleton;
    const char *from, *to, *says;
  };
  const Case cases[] = {{true, "order TX", "order WX", "no freedom"},
                        {true, "axis XYZ", "axis XXZ", "no order of axes"},
                        {true, "dof rx", "dof rx rx", "given twice"},
                        {true, "dof rx", "dof q", "no freedom"},
                        {true, "length 0.45", "length 0", "must be positive"},
                        {true, "name thorax", "name lowerback", "two bones are called lowerback"},
                        {true, "direction ", "direction nan ", "no usable number"},
                        {true, "root lowerback", "root", "has no place in the hierarchy"},
                        {true, "root lowerback", "head lowerback", "loop"},
                        {true, "root lowerback", "root lowerback thorax", "two parents"},
                        {true, "root lowerback", "root lowrback", "is no bone"},
                        {false, "lowerback ", "lowrback ", "did you mean 'lowerback'"},
                        {false, "lowerback ", "lowerback 1 ", "has 4 values"},
                        {false, "\n2\n", "\n3\n", "frame 3 follows frame 3"},
                        {false, "\n5\n", "\n1005\n", "more than a second"},
                        {false, "root ", "root inf ", "some.amc"},
                        {false, "lowerback", "#", "lacks bone lowerback"},
                        {false, "\n1\n", "\n", "frame's number expected"}};
  const auto refuse = [](const std::string& skeleton, const std::string& recording,
                         const char* says) {
    expect_refused([&] { convert_amc(recording, "some.amc", skeleton, "some.asf"); }, "some.a",
                   says);
  };
  for (const Case& c : cases) {
    if (c.skeleton)
      refuse(replaced(asf, c.from, c.to), amc, c.says);
    else
      refuse(asf, replaced(amc, c.from, c.to), c.says);
  }
  refuse("", amc, "holds no bones");
  refuse("HIERARCHY\n", amc, "does not begin with a section");
  refuse(asf, "", "holds no frames");
}

/// Freedoms that a person's bones do not have are read and left unused.
TEST_F(ImportersAmc, LengthsAndPlacesOfBonesAreLeftUnused) {
  const std::string asf = asf_text(), amc = amc_text(5);
  const MotionClip plain = convert_amc(amc, "a.amc", asf, "a.asf");
  for (const char* freedom : {"l", "L", "TX", "tx ty tz"}) {
    // The first bone that has freedoms: "lowerback a b c" in every frame.
    std::string more = amc;
    const std::string values = std::string(freedom).size() > 2 ? " 0.5 0 0" : " 0.5";
    for (size_t at = more.find("lowerback "); at != std::string::npos;
         at = more.find("lowerback ", at + 1))
      more.insert(more.find('\n', at), values);
    const std::string dof =
        asf.substr(asf.find("dof "), asf.find('\n', asf.find("dof ")) - asf.find("dof "));
    const MotionClip clip =
        convert_amc(more, "a.amc", replaced(asf, dof, dof + " " + freedom), "a.asf");
    ASSERT_EQ(clip.joints.size(), plain.joints.size());
    for (size_t f = 0; f < clip.joints.size(); ++f)
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_EQ(clip.joints[f][j], plain.joints[f][j]) << freedom;
    EXPECT_HAS(remarks(clip.report), "moved or stretched, by up to 0.5 units");
  }
}

/// Every fourth frame is a recording at a fourth of the rate; single frames that lack are filled.
TEST_F(ImportersAmc, FramesThatLackByTheirNumbers) {
  const auto renumbered = [](const auto& number) {  // frames of 0: left out
    std::string out;
    bool keep = true;
    std::istringstream lines(amc_text(41));
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty() && line.find_first_not_of("0123456789") == std::string::npos) {
        const int now = number(std::stoi(line));
        keep = now > 0;
        line = std::to_string(now);
      }
      if (keep) out += line + "\n";
    }
    return out;
  };
  const std::string asf = asf_text();
  const MotionClip whole = convert_amc(amc_text(41), "a.amc", asf, "a.asf");
  const auto fourth = renumbered([](int n) { return n % 4 == 1 ? n : 0; });
  const MotionClip sparse = convert_amc(fourth, "a.amc", asf, "a.asf");
  EXPECT_HAS(remarks(sparse.report), "one in 4 is there");
  ASSERT_EQ(sparse.joints.size(), whole.joints.size());
  for (size_t f = 0; f < whole.joints.size(); ++f)
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_LT((sparse.joints[f][j] - whole.joints[f][j]).norm(), 1e-9) << f;
  const auto gap = renumbered([](int n) { return n == 20 || n == 21 ? 0 : n; });
  const MotionClip filled = convert_amc(gap, "a.amc", asf, "a.asf");
  EXPECT_HAS(remarks(filled.report), "2 frames are lacking");
  ASSERT_EQ(filled.joints.size(), whole.joints.size());
  for (size_t f = 0; f < whole.joints.size(); ++f)
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_LT((filled.joints[f][j] - whole.joints[f][j]).norm(), 0.01) << f;
}

TEST_F(ImportersAmc, TheSkeletonBesideIsFoundByName) {
  const std::string recording = dir.write("07_01.amc", amc_text(3));
  EXPECT_THROW(find_asf(recording), InputError);
  const std::string other = dir.write("other.asf", "broken");
  EXPECT_EQ(find_asf(recording), other);  // the only one
  const std::string own = dir.write("07.asf", asf_text());
  dir.write("0.asf", "broken");
  EXPECT_EQ(find_asf(recording), own);
  EXPECT_EQ(read_amc(recording).motion.subject, "07");
  EXPECT_THROW(read_amc(recording, other), InputError);
}

// ---- the data folder

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

TEST_F(ImportersCmu, SourcesOfCopiesAreLeftOut) {
  const std::string file = data_folder() + "/cmu/clips30.h5";
  const std::string source = *clips_file().text("/clips/01_01", "source");
  size_t of_it = 0;
  for (const CmuClip& clip : all_clips())
    of_it += clips_file().text("/clips/" + clip.motion.id, "source") == source;
  const std::vector<Motion> left = import_cmu(file, {source});
  EXPECT_EQ(left.size(), all_clips().size() - of_it);
  EXPECT_GT(of_it, 0u);
  EXPECT_EQ(import_cmu(file, {"01_01", "02_01"}).size(), all_clips().size() - 2);
  std::vector<size_t> counts;
  EXPECT_EQ(import_cmu(file, {source, "01_01", source}, &counts).size(), left.size());
  EXPECT_EQ(counts, (std::vector<size_t>{of_it, 1, of_it})) << "each word counts all that it names";
  EXPECT_EQ(import_cmu(file, {source.substr(0, source.find('/'))}).size(), left.size());
  EXPECT_THROW(import_cmu(file, {source.substr(0, 3)}), InputError) << "no part of a name";
  EXPECT_LT(left.size(), all_clips().size());
  EXPECT_THROW(import_cmu(file, {"nobody/nothing"}), InputError);
  EXPECT_TRUE(is_packed_clips(file));
  TempDir dir;
  const ImportSummary whole = import_data(file, dir / "all.h5");
  EXPECT_EQ(whole.motions, 247u);
  EXPECT_EQ(whole.bodies, 0u);
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

/// The part of a recording that a clip of clips30.h5 was made from.
MotionOptions part_of(const std::string& clip) {
  const std::string group = "/clips/" + clip;
  MotionOptions options;
  options.drop_leading = static_cast<int>(*clips_file().number(group, "source_first_frame"));
  options.keep_frames = static_cast<size_t>(*clips_file().number(group, "source_frames"));
  return options;
}

/// The recording of a clip in data/cmu/FOLDER, empty if there is none: several clips may be of one.
std::string recording_of(const std::string& clip, const std::string& folder,
                         const std::string& ending) {
  for (const std::string& name : {clip, clip.substr(0, clip.size() - 1)}) {
    const std::string file = data_folder() + "/cmu/" + folder + "/" + name + ending;
    if (fs::exists(file)) return file;
  }
  return "";
}

TEST_F(ImportersCmu, BvhFilesGiveTheReferenceJoints) {
  size_t compared = 0;
  for (const std::string& clip : clips_file().children("/clips")) {
    const std::string file = recording_of(clip, "bvh", ".bvh.xz");
    const std::vector<float> expected = reference(clip);
    if (expected.empty() || file.empty() ||
        *clips_file().text("/clips/" + clip, "skeleton") != "daz")
      continue;  // the others' references are of the ASF skeletons
    MotionOptions options = part_of(clip);
    options.fps = *clips_file().number("/clips/" + clip, "source_fps");
    ++compared;
    const MotionClip bvh = read_bvh(file, options);
    EXPECT_LT(largest_difference(bvh.joints, expected), 2e-4) << clip;
    EXPECT_NEAR(bvh.floor_y, *clips_file().number("/clips/" + clip, "floor_y"), 2e-4) << clip;
    EXPECT_DOUBLE_EQ(bvh.scale, 0.01);
  }
  EXPECT_GE(compared, 15u);
}

TEST_F(ImportersAmc, CmuFilesGiveTheReferenceJoints) {
  RESTAGE_NEED_DATA();
  size_t compared = 0;
  for (const std::string& clip : clips_file().children("/clips")) {
    const std::string file = recording_of(clip, "asfamc", ".amc.xz");
    const std::vector<float> expected = reference(clip);
    if (file.empty() || expected.empty()) continue;
    const MotionClip got = read_amc(file, "", part_of(clip));
    ASSERT_EQ(got.joints.size() * kJoints * 3, expected.size()) << clip;
    double sum = 0;
    for (size_t i = 0; i < got.joints.size() * kJoints; ++i)
      sum += (got.joints[i / kJoints][i % kJoints] -
              Vec3(expected[3 * i], expected[3 * i + 1], expected[3 * i + 2]))
                 .norm();
    const double mean = sum / static_cast<double>(got.joints.size() * kJoints);
    EXPECT_LT(mean, 1e-4) << clip;
    std::printf("%s: mean joint error %.5f mm over %zu frames\n", clip.c_str(), 1000 * mean,
                got.joints.size());
    ++compared;
  }
  EXPECT_GE(compared, 4u);
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
  // The trunk follows bones that are none of the 22 joints (joint_fit.h).
  double worst = 0;
  for (size_t f = 0; f < bvh.joints.size(); ++f)
    for (const int j : {0, 1, 2, 4, 5, 7, 8, 10, 11, 15, 16, 17, 18, 19, 20, 21})
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
  EXPECT_HAS(error_of([&] { read_bvh(folder + "fairmotion_sinusoidal.bvh.xz"); }),
             "none of its 4 bones");
}

TEST_F(ImportersCmu, BrokenRootIsRefused) {
  EXPECT_HAS(error_of([&] { read_bvh(data_folder() + "/cmu/bvh/07_12.bvh.xz"); }), "root jumps");
}

}  // namespace
}  // namespace restage
