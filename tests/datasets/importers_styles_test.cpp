// BVH of CMU, Mixamo, LAFAN1, 100STYLE, SOMA ...: written by the test from known rotations, read
// back, and compared with them in degrees. And what the report says of each, and the profiles of
// bone names behind it: the built-in ones, files of one's own, and mistakes in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/motions/source_motion.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/importers_support.h"

namespace restage {
namespace {

using namespace test;
using bvh_test::bones_along_x;
using bvh_test::names_of;
using bvh_test::Style;
using ImportersProfiles = FileTest;

bool lacks(const Style& style, int j) {
  return std::find(style.without.begin(), style.without.end(), j) != style.without.end();
}

/// Largest and mean angle in degrees between the clip's world rotations and the truth's, over
/// joints that the file has.
struct Errors {
  double largest = 0, mean = 0;
};
Errors errors(const MotionClip& clip, const Style& style) {
  Errors out;
  size_t count = 0;
  for (size_t f = 0; f < clip.motion.frames(); ++f) {
    Rotations local;  // a joint that is not written does not turn
    for (int j = 0; j < kJoints; ++j)
      local[j] = lacks(style, j) ? Mat3(Mat3::Identity())
                                 : bvh_test::walk_turn(j, static_cast<double>(f) / 30);
    const Rotations truth = to_global(local);
    for (int j = 0; j < kJoints; ++j) {
      if (lacks(style, j)) continue;
      const Quat got = clip.motion.global[f][j].cast<double>().normalized();
      const double angle = got.angularDistance(Quat(truth[j])) * 180 / M_PI;
      out.largest = std::max(out.largest, angle);
      out.mean += angle;
      ++count;
    }
  }
  out.mean /= static_cast<double>(count);
  return out;
}

struct Family {
  std::string profile, prefix, units;
  double unit;
  double fps;
  bool z_up;
  std::vector<int> without;
};

TEST(ImportersStyles, FamiliesWithATPoseAreReadExactly) {
  const std::vector<Family> families = {
      {"daz", "", "centimetres", 0.01, 120, false, {9, 10, 11}},
      {"cmu", "", "inches / 0.45", 0.0254 / 0.45, 120, false, {9}},
      {"mixamo", "mixamorig:", "centimetres", 0.01, 30, false, {}},
      {"mixamo", "mixamorig_", "metres", 1.0, 24, true, {}},
      {"100style", "", "centimetres", 0.01, 60, false, {}},
      {"soma", "", "centimetres", 0.01, 120, false, {}},
      {"classic", "", "inches", 0.0254, 30, false, {}},
      {"makehuman", "", "decimetres", 0.1, 24, true, {}},
      {"makehuman_default", "", "decimetres", 0.1, 24, true, {}},
      {"smpl", "", "metres", 1.0, 60, false, {}},
      {"vrm", "", "metres", 1.0, 30, false, {}},
      {"unreal", "", "centimetres", 0.01, 30, true, {}},
      {"unreal5", "", "centimetres", 0.01, 30, true, {}},
      {"restage", "", "metres", 1.0, 30, false, {}}};
  for (const Family& family : families) {
    const std::string& profile = family.profile;
    const Style style{.wrapped = profile == "soma",
                      .unit = family.unit,
                      .z_up = family.z_up,
                      .fps = family.fps,
                      .frames = static_cast<int>(family.fps) + 1,
                      .names = names_of(profile, family.prefix),
                      .moving_root = profile == "soma",
                      .walks = true,
                      .without = family.without};
    MotionOptions options;
    options.drop_leading = 0;
    const MotionClip clip = convert_bvh(bvh_test::text(style), "01_walk.bvh", options);
    // Between the frames of 24 fps a swing is not what slerp makes of it.
    EXPECT_LT(errors(clip, style).largest, family.fps == 24 ? 1.0 : 0.01) << profile;
    EXPECT_NEAR(clip.scale, family.unit, 1e-12) << profile;
    const std::string expected = profile == "vrm" ? "unity" : profile;  // names equal but for case
    EXPECT_HAS(fact(clip.report, "names"), "(profile " + expected + ")");
    const std::string rate = family.fps == 30
                                 ? "30 fps, taken"
                                 : std::to_string(int(family.fps)) + " fps -> 30 fps, slerp";
    for (const auto& [name, begins] :
         {std::pair<const char*, std::string>{"units", family.units + ", by the legs"},
          {"up", family.z_up ? "z, by the rest pose" : "y, by the rest pose"},
          {"facing", family.z_up ? "-y" : "z"},
          {"rest pose", "zero rotations"},
          {"rate", rate}})
      EXPECT_TRUE(fact(clip.report, name).starts_with(begins)) << profile << " " << name;
    EXPECT_EQ(fact(clip.report, "off a T-pose"), "") << profile;
  }
}

TEST(ImportersStyles, ATPoseIsBuiltWhereZeroRotationsAreNone) {
  for (const std::string profile : {"lafan1", "soma"}) {
    const Style style{.wrapped = profile == "soma",
                      .fps = 30,
                      .frames = 61,
                      .bind = bones_along_x(),
                      .names = names_of(profile),
                      .moving_root = profile == "soma",
                      .walks = true};
    const MotionClip clip = convert_bvh(bvh_test::text(style), "walk1.bvh");
    EXPECT_HAS(fact(clip.report, "names"), profile);
    EXPECT_EQ(fact(clip.report, "up"), "y, by the recording");
    EXPECT_EQ(fact(clip.report, "rest pose").find("built"), 0u);
    for (const char* limb : {"left_hip 1", "right_knee 1", "left_shoulder", "right_elbow"})
      EXPECT_HAS(fact(clip.report, "turned"), limb);
    // The toy's own T-pose has its trunk 2 and its shins 4 degrees off the vertical.
    const Errors error = errors(clip, style);
    EXPECT_LT(error.largest, 6) << profile;
    EXPECT_LT(error.mean, 2.5) << profile;
    RecordProperty(profile + "_mean_degrees", std::to_string(error.mean));
    for (size_t f = 0; f < clip.joints.size(); ++f) {
      const PosedSkeleton truth = bvh_test::truth(static_cast<double>(f) / 30, true);
      for (int j = 0; j < kJoints; ++j)
        ASSERT_LT((clip.joints[f][j] - truth.joints[j]).norm(), 1e-4) << profile << f << " " << j;
    }
    const Joints& rest = clip.motion.rest;
    EXPECT_LT((rest[20] - rest[16]).normalized().dot(-Vec3::UnitX()), -0.9999);
    EXPECT_GT((rest[7] - rest[1]).normalized().dot(-Vec3::UnitY()), 0.9999);
  }
}

TEST(ImportersStyles, NoTPoseCanBeBuiltFromFramesThatShowNone) {
  std::string text =
      bvh_test::text({.frames = 3, .bind = bones_along_x(), .names = names_of("lafan1")});
  text = text.substr(0, text.find("Frame Time"));
  text += "Frame Time: 0.0333\n";
  for (int f = 0; f < 3; ++f) {  // zero rotations: both legs beside the head
    for (int i = 0; i < 6 + 21 * 3; ++i) text += "0 ";
    text += "\n";
  }
  MotionOptions options;
  options.rest.up = Axis::y;
  EXPECT_HAS(error_of([&] { convert_bvh(text, "zero.bvh", options); }), "none can be built");
}

/// A second of the toy that walks, in Mixamo's style but for its rate.
Style walking(double fps = 30) {
  return {.fps = fps, .frames = static_cast<int>(fps) + 1, .walks = true};
}

TEST(ImportersStyles, APosesAreReportedLimbByLimb) {
  Style style = walking();
  // Zero rotations: arms 45 degrees down. The T-pose is 45 degrees up from there.
  for (const auto& [j, side] : {std::pair{16, 1}, {18, 1}, {20, 1}, {17, -1}, {19, -1}, {21, -1}})
    style.bind[j] = Eigen::AngleAxisd(side * M_PI / 4, Vec3::UnitZ()).toRotationMatrix();
  const MotionClip clip = convert_bvh(bvh_test::text(style), "a.bvh");
  EXPECT_HAS(fact(clip.report, "off a T-pose"),
             "left_shoulder 45, right_shoulder 45, left_elbow 45, right_elbow 45 degrees");
  // Bone by bone, as pose_on does: world rotations of the arms are told from the arms' own rest.
  const PosedSkeleton truth = bvh_test::truth(0.5, true);
  const Mat3 got = clip.motion.global[15][16].cast<double>().toRotationMatrix();
  EXPECT_LT((got * style.bind[16].transpose() - truth.global[16]).norm(), 1e-4);
}

TEST(ImportersStyles, OptionsOverrideWhatIsFound) {
  const std::string text = bvh_test::text(walking(60));
  MotionOptions options;
  options.scale = 0.0125;
  options.fps = 30;
  options.rest.up = Axis::y;
  options.rest.facing = Axis::z;
  options.profile = "mixamo";
  options.subject = "ann";
  const MotionClip clip = convert_bvh(text, "a.bvh", options);
  EXPECT_EQ(clip.motion.frames(), 61u);
  EXPECT_DOUBLE_EQ(clip.scale, 0.0125);
  EXPECT_HAS(fact(clip.report, "units"), "as given");
  EXPECT_EQ(fact(clip.report, "up"), "y, as given");
  EXPECT_EQ(fact(clip.report, "facing"), "z, as given");
  EXPECT_EQ(clip.motion.subject, "ann");
  options.rest.facing = Axis::minus_z;  // its left would be its right
  EXPECT_THROW(convert_bvh(text, "a.bvh", options), InputError);
  options.rest.facing = Axis::y;
  EXPECT_THROW(convert_bvh(text, "a.bvh", options), InputError);
  options = {};
  options.profile = "daz";  // not its names
  EXPECT_HAS(error_of([&] { convert_bvh(text, "a.bvh", options); }),
             "lacks bones of the profile daz");
  for (const char* name : {"-y", "y-", "-Y"}) EXPECT_EQ(parse_axis(name, "--up"), Axis::minus_y);
  for (const char* name : {"z", "+z", "z+", "Z"}) EXPECT_EQ(parse_axis(name, "--up"), Axis::z);
  EXPECT_EQ(parse_axis("auto", "--up"), Axis::automatic);
  for (const char* name : {"", "-", "--y", "w", "yz", "+"})
    EXPECT_THROW(parse_axis(name, "--up"), InputError) << name;
  EXPECT_THROW(parse_axis("north", "--up"), InputError);
}

TEST(ImportersStyles, FilesUnlikeTheirFamilyGetARemark) {
  Style style = walking();  // 100STYLE has 60 frames a second, and centimetres
  style.names = names_of("100style");
  style.unit = 0.0254;
  const MotionClip clip = convert_bvh(bvh_test::text(style), "a.bvh");
  EXPECT_HAS(remarks(clip.report), "60 fps, this one 30 fps");
  EXPECT_HAS(remarks(clip.report), "centimetres, this one inches");
}

TEST(ImportersStyles, AnyAxisMayBeUp) {
  std::string text = bvh_test::text(walking());
  // Upside down: a half turn about x before everything else, by a bone above the hips.
  text.replace(text.find("ROOT mixamorig:Hips"), 19, "JOINT mixamorig:Hips");
  text.insert(text.find("JOINT"),
              "ROOT world\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n");
  text.insert(text.find("MOTION"), "}\n");
  for (size_t at = text.find('\n', text.find("Frame Time")); at + 1 < text.size();
       at = text.find('\n', at + 1))
    text.insert(at + 1, "180 0 0 ");
  const MotionClip clip = convert_bvh(text, "a.bvh");
  EXPECT_EQ(fact(clip.report, "up"), "y, by the rest pose");
  EXPECT_HAS(remarks(clip.report), "up -y");
}

// ---- profiles of bone names
// ----------------------------------------------------------------------

std::string own_profile() {
  std::string out = "title: Suit\njoints:\n";
  for (const std::string_view joint : kJointNames)
    if (joint != "spine3") out += "  " + std::string(joint) + ": b_" + std::string(joint) + "\n";
  return out;
}

/// A skeleton of the bones that the profile names first.
SourceSkeleton skeleton_of(const Profile& profile) {
  SourceSkeleton out;
  std::array<int, kJoints> at{};
  for (size_t j = 0; j < kJoints; ++j) {
    int parent = j == 0 ? -1 : kParents[j];
    while (parent > 0 && profile.bones[static_cast<size_t>(parent)].empty())
      parent = kParents[static_cast<size_t>(parent)];
    if (profile.bones[j].empty()) continue;
    at[j] = static_cast<int>(out.size());
    out.names.push_back(profile.bones[j][0]);
    out.parents.push_back(parent < 0 ? -1 : at[static_cast<size_t>(parent)]);
    out.offsets.push_back(Vec3(0, 0.1, 0));
    out.ends.push_back(Vec3(0, 0, 0.1));
    out.has_end.push_back(1);
  }
  return out;
}

TEST_F(ImportersProfiles, EveryBuiltInOneFindsItsOwnNames) {
  std::set<std::string> names;
  for (const Profile& profile : builtin_profiles()) {
    names.insert(profile.name);
    EXPECT_FALSE(profile.title.empty());
    const NamedJoints found = name_joints(skeleton_of(profile), profile.name);
    EXPECT_EQ(found.profile->bones[0].empty(), false);
    if (profile.name != "vrm") {  // unity's names but for case
      EXPECT_EQ(found.profile->name, profile.name);
    }
    EXPECT_EQ(name_joints(skeleton_of(profile), "x", &profile).profile, &profile);
  }
  for (const char* name : {"daz", "cmu", "asf", "mixamo", "lafan1", "100style", "soma", "smpl",
                           "vrm", "unreal", "unity", "makehuman", "restage"})
    EXPECT_EQ(names.count(name), 1u) << name;
}

TEST_F(ImportersProfiles, OnesOwnFileIsAsGood) {
  const Profile profile = find_profile(
      dir.write("suit.yaml", own_profile() + "places: {spine3: {from: spine2, to: b_neck, share: "
                                             "0.5}}\nexpect: {units: metres, up: z, fps: 90}\n"));
  EXPECT_EQ(profile.name, "suit");
  EXPECT_EQ(profile.fps, 90);
  const SourceSkeleton skeleton = skeleton_of(profile);
  const NamedJoints found = name_joints(skeleton, "x.bvh", &profile);
  EXPECT_EQ(found.placed, std::vector<int>{9});
  const Joints rest = rest_joints(skeleton, found.map);
  EXPECT_LT((rest[9] - 0.5 * (rest[6] + rest[12])).norm(), 1e-12);
}

std::string style_complaint(const std::string& yaml) {
  return refusal_of([&] { parse_profile(yaml, "suit.yaml"); });
}

TEST_F(ImportersProfiles, MistakesAreNamedWithLineAndNearestName) {
  const std::string good = own_profile();
  EXPECT_EQ(style_complaint(good), "");
  const std::pair<std::string, const char*> cases[] = {
      {good + "jonts: {}\n", "suit.yaml:24: 'jonts' is not known here; did you mean 'joints'?"},
      {good + "\"a\\nb\": x\n", "'a?b' is not known here"},
      {good + "  left_hipp: x\n", "did you mean 'left_hip'?"},
      {good + "  left_hip: x\n", "given twice"},
      {"title: x\n", "names no bone for pelvis"},
      {good.substr(good.find("joints")), "has no title; write a first line"},
      {"title: x\npelvis: Hips\n", "suit.yaml:2: 'pelvis' is a joint and belongs under 'joints:'"},
      {good + "expect: {fps: fast}\n", "a number is expected"},
      {good + "places: {spine3: {from: spine2}}\n", "'from' and 'to'"},
      {good + "places: {head: {from: neck, to: neck}}\n", "not known here"},
      {good + std::string(70000, '#'), "longer than"}};
  for (const auto& [yaml, says] : cases) EXPECT_HAS(style_complaint(yaml), says);
  for (const std::string& bad :
       Names{"", "- a\n", "title: [\n", "\t", "a: &b [*b]\n", "title: {a: b}\n", "%YAML 9.9\n---\n",
             "title: x\njoints: 3\n", "title: " + std::string(20000, '[')})
    EXPECT_EQ(style_complaint(bad).find("suit.yaml"), 0u) << bad << ": " << style_complaint(bad);
  for (size_t cut = 0; cut < good.size(); cut += 7)
    style_complaint(good.substr(0, cut));  // no crash
}

TEST_F(ImportersProfiles, UnknownNamesAreAnsweredWithTheNearest) {
  EXPECT_HAS(error_of([&] { find_profile("miximo"); }), "did you mean 'mixamo'?");
  EXPECT_THROW(find_profile("no/such.yaml"), InputError);
  SourceSkeleton skeleton = skeleton_of(find_profile("mixamo"));
  for (std::string& name : skeleton.names)
    if (name == "LeftUpLeg") name = "LeftUpLegg";
  EXPECT_HAS(error_of([&] { name_joints(skeleton, "a.bvh"); }), "left_hip (is it 'LeftUpLegg'?)");
}

}  // namespace
}  // namespace restage
