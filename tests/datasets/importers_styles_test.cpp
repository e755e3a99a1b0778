// BVH of CMU, Mixamo, LAFAN1, 100STYLE, SOMA ...: written by the test from known rotations, read
// back, and compared with them in degrees. And what the report says of each.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "datasets/importers/bvh.h"
#include "tests/datasets/importers_bvh_styles.h"

namespace restage {
namespace {

using bvh_test::bones_along_x;
using bvh_test::names_of;
using bvh_test::Style;

std::string fact(const ImportReport& report, const std::string& name) {
  for (const auto& [key, value] : report.facts)
    if (key == name) return value;
  return "";
}

std::string remarks(const ImportReport& report) {
  std::string out;
  for (const std::string& remark : report.remarks) out += remark + "\n";
  return out;
}

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
      {"classic", "", "inches", 0.0254, 30, false, {9}},
      {"makehuman", "", "decimetres", 0.1, 24, true, {}},
      {"makehuman_default", "", "decimetres", 0.1, 24, true, {}},
      {"smpl", "", "metres", 1.0, 60, false, {}},
      {"vrm", "", "metres", 1.0, 30, false, {}},
      {"unreal", "", "centimetres", 0.01, 30, true, {}},
      {"unreal5", "", "centimetres", 0.01, 30, true, {}},
      {"restage", "", "metres", 1.0, 30, false, {}}};
  for (const Family& family : families) {
    Style style;
    style.names = names_of(family.profile, family.prefix);
    style.unit = family.unit;
    style.fps = family.fps;
    style.frames = static_cast<int>(family.fps) + 1;
    style.z_up = family.z_up;
    style.without = family.without;
    style.wrapped = style.moving_root = family.profile == "soma";
    style.walks = true;
    MotionOptions options;
    options.drop_leading = 0;
    const MotionClip clip = convert_bvh(bvh_test::text(style), "01_walk.bvh", options);
    const std::string& profile = family.profile;
    // Between the frames of 24 fps a swing is not what slerp makes of it.
    EXPECT_LT(errors(clip, style).largest, family.fps == 24 ? 1.0 : 0.01) << profile;
    EXPECT_NEAR(clip.scale, family.unit, 1e-12) << profile;
    const std::string names = fact(clip.report, "names");
    const std::string expected = profile == "vrm" ? "unity" : profile;  // names equal but for case
    EXPECT_NE(names.find("(profile " + expected + ")"), std::string::npos) << names;
    EXPECT_EQ(fact(clip.report, "units").find(family.units + ", by the legs"), 0u) << profile;
    EXPECT_EQ(fact(clip.report, "up"),
              (family.z_up ? "z" : "y") + std::string(", by the rest pose"));
    EXPECT_EQ(fact(clip.report, "facing").find(family.z_up ? "-y" : "z"), 0u) << profile;
    EXPECT_EQ(fact(clip.report, "rest pose"), "zero rotations");
    EXPECT_EQ(fact(clip.report, "off a T-pose"), "") << profile;
    const std::string rate = fact(clip.report, "rate");
    EXPECT_EQ(
        rate.find(family.fps == 30 ? "30 fps, taken"
                                   : std::to_string(int(family.fps)) + " fps -> 30 fps, slerp"),
        0u)
        << rate;
  }
}

TEST(ImportersStyles, ATPoseIsBuiltWhereZeroRotationsAreNone) {
  for (const std::string profile : {"lafan1", "soma"}) {
    Style style;
    style.names = names_of(profile);
    style.bind = bones_along_x();
    style.fps = 30;
    style.frames = 61;
    style.walks = true;
    style.wrapped = style.moving_root = profile == "soma";
    const MotionClip clip = convert_bvh(bvh_test::text(style), "walk1.bvh");
    EXPECT_NE(fact(clip.report, "names").find(profile), std::string::npos);
    EXPECT_EQ(fact(clip.report, "up"), "y, by the recording");
    EXPECT_EQ(fact(clip.report, "rest pose").find("built"), 0u);
    for (const char* limb : {"left_hip 1", "right_knee 1", "left_shoulder", "right_elbow"})
      EXPECT_NE(fact(clip.report, "turned").find(limb), std::string::npos)
          << fact(clip.report, "turned");
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
  Style style;
  style.names = names_of("lafan1");
  style.bind = bones_along_x();
  style.frames = 3;
  std::string text = bvh_test::text(style);
  text = text.substr(0, text.find("Frame Time"));
  text += "Frame Time: 0.0333\n";
  for (int f = 0; f < 3; ++f) {  // zero rotations: both legs beside the head
    for (int i = 0; i < 6 + 21 * 3; ++i) text += "0 ";
    text += "\n";
  }
  MotionOptions options;
  options.rest.up = Axis::y;
  try {
    convert_bvh(text, "zero.bvh", options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("none can be built"), std::string::npos)
        << error.what();
  }
}

TEST(ImportersStyles, APosesAreReportedLimbByLimb) {
  Style style;
  style.fps = 30;
  style.frames = 31;
  style.walks = true;
  // Zero rotations: arms 45 degrees down. The T-pose is 45 degrees up from there.
  for (const auto& [j, side] : {std::pair{16, 1}, {18, 1}, {20, 1}, {17, -1}, {19, -1}, {21, -1}})
    style.bind[j] = Eigen::AngleAxisd(side * M_PI / 4, Vec3::UnitZ()).toRotationMatrix();
  const MotionClip clip = convert_bvh(bvh_test::text(style), "a.bvh");
  EXPECT_EQ(fact(clip.report, "off a T-pose")
                .find("left_shoulder 45, right_shoulder 45, left_elbow 45, right_elbow 45 degrees"),
            0u)
      << fact(clip.report, "off a T-pose");
  // Bone by bone, as pose_on does: world rotations of the arms are told from the arms' own rest.
  const PosedSkeleton truth = bvh_test::truth(0.5, true);
  const Mat3 got = clip.motion.global[15][16].cast<double>().toRotationMatrix();
  EXPECT_LT((got * style.bind[16].transpose() - truth.global[16]).norm(), 1e-4);
}

TEST(ImportersStyles, OptionsOverrideWhatIsFound) {
  Style style;
  style.fps = 60;
  style.frames = 61;
  style.walks = true;
  const std::string text = bvh_test::text(style);
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
  EXPECT_NE(fact(clip.report, "units").find("as given"), std::string::npos);
  EXPECT_EQ(fact(clip.report, "up"), "y, as given");
  EXPECT_EQ(fact(clip.report, "facing"), "z, as given");
  EXPECT_EQ(clip.motion.subject, "ann");
  options.rest.facing = Axis::minus_z;  // its left would be its right
  EXPECT_THROW(convert_bvh(text, "a.bvh", options), InputError);
  options.rest.facing = Axis::y;
  EXPECT_THROW(convert_bvh(text, "a.bvh", options), InputError);
  options = {};
  options.profile = "daz";  // not its names
  try {
    convert_bvh(text, "a.bvh", options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lacks bones of the profile daz"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(parse_axis("-y", "--up"), Axis::minus_y);
  EXPECT_THROW(parse_axis("north", "--up"), InputError);
}

TEST(ImportersStyles, FilesUnlikeTheirFamilyGetARemark) {
  Style style;
  style.names = names_of("100style");
  style.fps = 30;  // 100STYLE is 60
  style.unit = 0.0254;
  style.frames = 31;
  style.walks = true;
  const MotionClip clip = convert_bvh(bvh_test::text(style), "a.bvh");
  EXPECT_NE(remarks(clip.report).find("60 fps, this one 30 fps"), std::string::npos)
      << remarks(clip.report);
  EXPECT_NE(remarks(clip.report).find("centimetres, this one inches"), std::string::npos);
}

TEST(ImportersStyles, AnyAxisMayBeUp) {
  Style style;
  style.fps = 30;
  style.frames = 31;
  style.walks = true;
  std::string text = bvh_test::text(style);
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
  EXPECT_NE(remarks(clip.report).find("--up -y"), std::string::npos) << remarks(clip.report);
}

}  // namespace
}  // namespace restage
