// BVH import on files written by the test: every style of the same motion gives the same motion.
// Files that are cut, flipped, deep or announce what they do not hold are refused with a line:
// never a crash, never much memory.
#include <gtest/gtest.h>

#include <cmath>

#include "datasets/importers/motions/bvh.h"
#include "datasets/readers/skeletons/bvh.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/npz_support.h"

namespace restage {
namespace {

using namespace test;
using bvh_test::Style;
using ImportersBvh = FileTest;
using ReadersRecordings = FileTest;

/// `clip` is the motion of importers_bvh_text.h from t = 0 on.
void expect_motion(const MotionClip& clip, size_t frames, const std::string& what) {
  ASSERT_EQ(clip.motion.frames(), frames) << what;
  ASSERT_EQ(clip.joints.size(), frames) << what;
  for (int j = 0; j < kJoints; ++j)
    ASSERT_LT((clip.motion.rest[j] - (bvh_test::rest()[j] - bvh_test::rest()[0])).norm(), 1e-5)
        << what << j;
  for (size_t f = 0; f < frames; ++f) {
    const PosedSkeleton truth = bvh_test::truth(static_cast<double>(f) / 30);
    for (int j = 0; j < kJoints; ++j) {
      ASSERT_LT((clip.joints[f][j] - truth.joints[j]).norm(), 2e-5)
          << what << " frame " << f << " joint " << j;
      const Mat3 got = clip.motion.global[f][j].cast<double>().toRotationMatrix();
      ASSERT_LT((got - truth.global[j]).norm(), 2e-5) << what << " frame " << f << " joint " << j;
    }
    const Vec3 hips = 0.5 * (truth.joints[1] + truth.joints[2]) - Vec3(0, clip.floor_y, 0);
    ASSERT_LT((clip.motion.hips[f].cast<double>() - hips).norm(), 2e-5) << what << f;
  }
}

MotionClip convert(const Style& style, MotionOptions options = {}) {
  if (options.drop_leading < 0) options.drop_leading = 0;
  return convert_bvh(bvh_test::text(style), "test.bvh", options);
}

TEST_F(ImportersBvh, AnyChannelOrder) {
  for (const std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"})
    for (const bool first : {false, true})
      expect_motion(convert({.rotations = order,
                             .root_rotations = std::string(order.rbegin(), order.rend()),
                             .rotations_first = first,
                             .frames = 41}),
                    11, order);
}

TEST_F(ImportersBvh, AnyJointOrderAndHierarchy) {
  Style style{.reversed = true};
  expect_motion(convert(style), 31, "reversed");
  style.all_positions = true;
  expect_motion(convert(style), 31, "positions of all joints");
  style.wrapped = true;
  expect_motion(convert(style), 31, "hips below a reference joint");
}

TEST_F(ImportersBvh, AnyFrameRateIsTrulyResampled) {
  for (const double fps : {24.0, 25.0, 29.97, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0}) {
    const Style style{.fps = fps, .frames = static_cast<int>(std::floor(fps + 1e-9)) + 1};
    const double last = (style.frames - 1) / fps;
    const size_t frames = static_cast<size_t>(std::floor(last * 30 + 1e-3)) + 1;
    expect_motion(convert(style), frames, "fps " + std::to_string(fps));
  }
  // The file says 120, the recording was made at 60.
  std::string text = bvh_test::text({.fps = 60});
  text.replace(text.find("0.0166666667"), 12, "0.00833333");
  MotionOptions options;
  options.fps = 60;
  options.drop_leading = 0;
  expect_motion(convert_bvh(text, "test.bvh", options), 61, "given fps");
}

TEST_F(ImportersBvh, AnyUnitAndUpAxisAndFacing) {
  for (const double unit : {1.0, 0.1, 0.0254 / 0.45, 0.0254, 0.01, 0.001}) {
    const MotionClip clip = convert({.unit = unit});
    EXPECT_DOUBLE_EQ(clip.scale, unit);
    expect_motion(clip, 31, "unit " + std::to_string(unit));
  }
  for (const bool z_up : {false, true})
    for (const int turns : {0, 1, 2, 3})
      expect_motion(convert({.z_up = z_up, .quarter_turns = turns}), 31, "z_up, turns");
  MotionOptions yards;  // a leg of 0.9 units would pass for metres, so by hand
  yards.scale = 0.0254 * 12 * 3;
  expect_motion(convert({.unit = yards.scale}, yards), 31, "yards");
  EXPECT_NO_THROW(convert({.unit = 0.2}));           // a leg of 4.2 units: decimetres by the rule
  EXPECT_THROW(convert({.unit = 0.4}), InputError);  // 2.1 units: nobody's leg
}

TEST_F(ImportersBvh, ZeroPoseThatIsNoTPoseIsReplacedByARestFrameOrBuilt) {
  Style style{.frames = 122, .t_pose_first = true};
  for (int j = 0; j < kJoints; ++j)
    style.bind[j] =
        Eigen::AngleAxisd(2.0 + j, Vec3(j % 3 - 1, 1, j % 4).normalized()).toRotationMatrix();
  MotionOptions options;
  options.rest.frame = 0;
  options.drop_leading = 1;
  options.scale = style.unit;
  options.rest.up = Axis::y;
  expect_motion(convert(style, options), 31, "rest frame");
  options.rest.frame = -1;  // importers_styles_test.cpp has how well that does
  EXPECT_TRUE(fact(convert(style, options).report, "rest pose").starts_with("built"));
  options.rest.frame = 500;
  EXPECT_THROW(convert(style, options), InputError);
}

TEST_F(ImportersBvh, MissingSpineNeckCollarsAndToesArePlaced) {
  const MotionClip clip = convert({.without = {6, 9, 12, 13, 14, 10, 11}});
  const Joints& rest = clip.motion.rest;
  EXPECT_LT((rest[10] - (bvh_test::rest()[10] - bvh_test::rest()[0])).norm(),
            1e-5);  // the end site
  for (const auto& [below, above] : {std::pair{3, 6}, {6, 9}, {9, 12}, {12, 15}})
    EXPECT_GT(rest[above].y(), rest[below].y() + 0.02) << below;
  EXPECT_GT(rest[13].x(), 0.0);
  EXPECT_LT(rest[13].x(), rest[16].x());
  for (size_t f = 0; f < clip.motion.frames(); ++f)
    EXPECT_LT(clip.motion.global[f][9].angularDistance(clip.motion.global[f][3]), 1e-6);
  EXPECT_HAS(error_of([&] { convert({.without = {12, 15}}); }), "not found among its bones: head");
}

TEST_F(ImportersBvh, LeadingAndKeptFrames) {
  MotionOptions options;
  options.drop_leading = 20;
  options.keep_frames = 41;
  const MotionClip clip = convert({}, options);
  ASSERT_EQ(clip.motion.frames(), 11u);
  EXPECT_LT((clip.joints[0][21] - bvh_test::truth(20 / 120.0).joints[21]).norm(), 2e-5);
  options.drop_leading = 121;
  EXPECT_THROW(convert({}, options), InputError);
}

TEST_F(ImportersBvh, JumpingRootIsRefused) {
  std::string text = bvh_test::text({.frames = 5});
  const size_t line = text.rfind('\n', text.size() - 2) + 2;
  text.insert(line, "9");  // hips of the last frame metres away
  EXPECT_HAS(error_of([&] { convert_bvh(text, "test.bvh"); }), "frame 3 to 4");
  MotionOptions options;
  options.max_root_speed = 0;
  EXPECT_NO_THROW(convert_bvh(text, "test.bvh", options));
}

/// Trunk and legs that hang beside each other on a still root, each told where it is: `torn` metres
/// a second apart. The pelvis turns and walks away.
std::string beside(double torn) {
  std::string out = "HIERARCHY\nROOT Root\n{\nOFFSET 0 0 0\nCHANNELS 0\n";
  const Joints& rest = bvh_test::rest();
  std::vector<int> order;
  const std::function<void(int)> write = [&](int j) {
    order.push_back(j);
    const bool free = j == 0 || j == 3;
    const Vec3 offset = j == 3   ? rest[3]
                        : j == 0 ? Vec3(Vec3::Zero())
                                 : rest[j] - rest[kParents[j]];
    out += "JOINT " + std::string(kJointNames[j]) + "\n{\nOFFSET" + bvh_test::vector_text(offset) +
           (free ? "\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
                 : "\nCHANNELS 3 Zrotation Xrotation Yrotation\n");
    for (int k = 1; k < kJoints; ++k)
      if (kParents[k] == j && k != 3) write(k);
    out += "}\n";
  };
  write(0);
  write(3);
  out += "}\nMOTION\nFrames: 30\nFrame Time: 0.0333333333\n";
  for (int f = 0; f < 30; ++f) {
    const double t = f / 30.0;
    const Mat3 yaw = Eigen::AngleAxisd(t, Vec3::UnitY()).toRotationMatrix();
    const Vec3 hips = bvh_test::hips(t);
    for (const int j : order) {
      const Vec3 at = j == 0 ? hips : Vec3(hips + yaw * (rest[3] - rest[0]) + Vec3(0, torn * t, 0));
      if (j == 0 || j == 3) out += bvh_test::vector_text(at);
      out += " 0 0" + bvh_test::number(j == 0 || j == 3 ? t * 180 / M_PI : 0);
    }
    out += "\n";
  }
  return out;
}

TEST_F(ImportersBvh, ASpineBesideItsPelvisMovesWithIt) {
  const MotionClip clip = convert_bvh(beside(0), "x.bvh", {});
  for (size_t f = 0; f < clip.motion.frames(); f += 5) {
    const Mat3 yaw =
        Eigen::AngleAxisd(static_cast<double>(f) / 30, Vec3::UnitY()).toRotationMatrix();
    for (int j = 0; j < kJoints; ++j) {
      const Vec3 at = bvh_test::hips(static_cast<double>(f) / 30) +
                      yaw * (bvh_test::rest()[j] - bvh_test::rest()[0]);
      EXPECT_LT((clip.joints[f][j] - at).norm(), 1e-5) << f << " " << kJointNames[j];
      EXPECT_LT((clip.motion.rest[j] - (bvh_test::rest()[j] - bvh_test::rest()[0])).norm(), 1e-5);
    }
  }
  EXPECT_TRUE(clip.report.remarks.empty());
  const MotionClip loose = convert_bvh(beside(0.2), "x.bvh", {});
  ASSERT_EQ(loose.report.remarks.size(), 1u);
  EXPECT_HAS(loose.report.remarks[0], "spine1 is up to 0.097 m");
  EXPECT_HAS(refusal_of([&] { convert_bvh(beside(1.5), "x.bvh", {}); }), "against the pelvis");
}

TEST_F(ImportersBvh, ReadsPlainAndXzFiles) {
  const std::string text = bvh_test::text({}), xz = xz_of(text, 8);
  const std::string plain = dir.write("07_01.bvh", text), file = dir.write("07_01.bvh.xz", xz);
  MotionOptions options;
  options.drop_leading = 0;
  expect_motion(read_bvh(plain, options), 31, "plain");
  expect_motion(read_bvh(file, options), 31, "xz");
  EXPECT_EQ(read_bvh(file, options).motion.id, "07_01");
  EXPECT_THROW(read_bvh(dir.write("cut.bvh.xz", xz.substr(0, xz.size() / 2)), options), InputError);
  EXPECT_THROW(read_bvh(dir / "no_such.bvh"), InputError);
}

TEST_F(ImportersBvh, BadFilesAreNamedWithTheirLine) {
  const std::string good = bvh_test::text({}), motion = good.substr(good.find("MOTION"));
  std::vector<std::string> bad = {"",
                                  "\n\n",
                                  "HIERARCHY",
                                  "RIFF\x01\x02",
                                  good.substr(0, good.find("MOTION")),
                                  good.substr(0, good.rfind('\n', good.size() - 2) + 1),
                                  "HIERARCHY\n" + motion};
  for (const auto& [from, to] : {std::pair{"Frames: 121", "Frames: 0"},
                                 {"Frames: 121", "Frames: 99999999999999999999"},
                                 {"Frames: 121", "Frames: -1"},
                                 {"Frames: 121", "Frames: nan"},
                                 {"Frame Time: 0.0083", "Frame Time: 9990.0083"},
                                 {"Frame Time: 0.0083", "Frame Time: -0.0083"},
                                 {"OFFSET", "OFFSET 1"},
                                 {"OFFSET 0", "OFFSET x"},
                                 {"OFFSET 0", "OFFSET inf"},
                                 {"CHANNELS 6", "CHANNELS 7"},
                                 {"CHANNELS 6", "CHANNELS 99999999999"},
                                 {"Xposition", "Wposition"},
                                 {"Yposition", "Xposition"},
                                 {"JOINT", "ROOT"},
                                 {"\n{", "\n"},
                                 {"\n}", "\n"},
                                 {"\n}", "\n}\n}"},
                                 {"End Site", "JOINT"},
                                 {"ROOT mixamorig:Hips", "ROOT"},
                                 {"HIERARCHY", "HIERARCHY\n{"},
                                 {"HIERARCHY", "HIERARCHY\nOFFSET 0 0 0"}})
    bad.push_back(replaced(good, from, to));
  for (size_t percent = 0; percent < 100; ++percent)
    bad.push_back(good.substr(0, good.size() * percent / 100));
  for (const std::string& text : bad) {
    SCOPED_TRACE(text.substr(0, 300));
    expect_refused([&] { convert_bvh(text, "some.bvh"); }, "some.bvh:", "");
  }
}

// ---- names and rates as they are in the file

TEST_F(ReadersRecordings, NamesStayThemselves) {
  bvh_test::Style style{.frames = 3};
  style.names = {"センター", "左足",   "右足",   "上半身",  "左ひざ",   "右ひざ",
                 "上半身2",  "左足首", "右足首", "上半身3", "左つま先", "右つま先",
                 "首",       "左肩",   "右肩",   "頭",      "左腕",     "右腕",
                 "左ひじ",   "右ひじ", "左手首", "右手首"};
  const std::string text = bvh_test::text(style);
  EXPECT_EQ(parse_bvh(text, "x.bvh").skeleton.names[0], "センター");
  EXPECT_TRUE(convert_bvh(text, "x.bvh").motion.frames() > 0);
  for (std::string& name : style.names)  // far longer than what a message shows
    name = "Session_2024_03_12_Take_004_Performer_0001:" + name;
  EXPECT_EQ(parse_bvh(bvh_test::text(style), "x.bvh").skeleton.names[0],
            "Session_2024_03_12_Take_004_Performer_0001:センター");
  EXPECT_TRUE(convert_bvh(bvh_test::text(style), "x.bvh").motion.frames() > 0);
  style.names.assign(22, "\x8D\xB6\x91\xAB");  // Shift-JIS
  EXPECT_HAS(refusal_of([&] { convert_bvh(bvh_test::text(style), "x.bvh"); }), "Shift-JIS");
  style.names.assign(22, std::string(2000, 'a'));
  EXPECT_HAS(refusal_of([&] { convert_bvh(bvh_test::text(style), "x.bvh"); }), "1000 bytes");
}

TEST_F(ReadersRecordings, AFrameTimeThatIsNoneNeedsTheRate) {
  std::string text = bvh_test::text({.fps = 30, .frames = 4});
  const size_t at = text.find("Frame Time:"), end = text.find('\n', at);
  for (const char* time : {"0", "0.000000", "-1", "1e9"}) {
    text.replace(at, text.find('\n', at) - at, std::string("Frame Time: ") + time);
    EXPECT_HAS(refusal_of([&] { convert_bvh(text, "x.bvh"); }), "give the true rate with fps");
    MotionOptions told;
    told.fps = 30;
    const MotionClip clip = convert_bvh(text, "x.bvh", told);
    EXPECT_EQ(clip.motion.frames(), 4u);
    EXPECT_EQ(clip.report.remarks.size(), 0u);
  }
  EXPECT_LT(at, end);
}

TEST_F(ReadersRecordings, AFrameTimeMayHaveADecimalComma) {
  std::string text = bvh_test::text({.fps = 30, .frames = 4});
  const size_t at = text.find("Frame Time:");
  for (const char* time : {"0,0333333", " 0,0333333  ", "0,0333", "3,33333e-2"}) {
    text.replace(at, text.find('\n', at) - at, std::string("Frame Time: ") + time);
    EXPECT_EQ(convert_bvh(text, "x.bvh").motion.frames(), 4u) << time;
  }
  text.replace(at, text.find('\n', at) - at, "Frame Time: 0, 0333333");
  EXPECT_HAS(refusal_of([&] { convert_bvh(text, "x.bvh"); }), "is no usable number");
  text = bvh_test::text({.fps = 30, .frames = 4});
  text.replace(text.find("Frames: 4"), 9, "Frames: 1,000");  // a thousand is not one
  EXPECT_HAS(refusal_of([&] { convert_bvh(text, "x.bvh"); }), "is no usable number");
}

// ---- files that ask for too much

std::string complaint(const std::string& text) {
  return refusal_of([&] { convert_bvh(text, "x.bvh"); });
}

std::string small_file() { return bvh_test::text({.frames = 12}); }

/// A chain of `depth` joints, one in the other.
std::string deep(size_t depth) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n";
  for (size_t i = 1; i < depth; ++i) text += "JOINT b" + std::to_string(i) + "\n{\nOFFSET 0 1 0\n";
  for (size_t i = 0; i < depth; ++i) text += "}\n";
  return text + "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n";
}

TEST_F(ReadersRecordings, DepthIsNoMatterButCountsAreLimited) {
  EXPECT_EQ(parse_bvh(deep(4096), "x.bvh").skeleton.size(), 4096u);
  EXPECT_HAS(complaint(deep(4097)), "more than 4096 joints");
  EXPECT_HAS(complaint(std::string(1 << 20, '{')), "x.bvh:1");
}

TEST_F(ReadersRecordings, AnnouncedCountsAreNotBelieved) {
  const std::string good = small_file();
  EXPECT_HAS(complaint(replaced(good, "Frames: 12", "Frames: 999999999")), "ends after 12 of");
  // Vendors miscount: what is announced is read, what follows is left out, whatever it is.
  const MotionClip eleven =
      convert_bvh(replaced(good, "Frames: 12", "Frames: 11") + "and notes\n", "x.bvh");
  EXPECT_EQ(eleven.report.remarks.size(), 1u);
  EXPECT_HAS(eleven.report.remarks.back(), "announces 11; left out");
  EXPECT_HAS(complaint(replaced(good, "Frames: 12", "Frames: 13")), "ends after 12 of");
  std::string wide = good.substr(0, good.find("Frame Time")) + "Frame Time: 0.01\n";
  for (int i = 0; i < 200000; ++i) wide += "0 ";
  EXPECT_HAS(complaint(wide), "65537 values");
}

/// The unpacker would take the memory that the file asks for.
TEST_F(ReadersRecordings, PackedTextsThatAskForMuchMemoryAreRefused) {
  const auto refusal = [&](uint32_t mebibytes) {
    dir.write("x.bvh.xz", xz_of(small_file(), mebibytes));
    return refusal_of([&] { read_bvh(dir / "x.bvh.xz"); });
  };
  EXPECT_EQ(refusal(64), "");  // xz -9
  EXPECT_HAS(refusal(128), "takes more than 80 MiB to unpack");
}

/// A few bytes a frame at one frame per second, or thousands of joints that never move, would be
/// gigabytes in memory.
TEST_F(ReadersRecordings, SmallFilesThatMakeLongMotionsAreRefused) {
  const std::string good = small_file();
  const std::string head = good.substr(0, good.find("MOTION"));
  const auto recording = [](const std::string& hierarchy, size_t channels, int frames) {
    std::string line,
        text = hierarchy + "MOTION\nFrames: " + std::to_string(frames) + "\nFrame Time: 1\n";
    for (size_t c = 0; c < channels; ++c) line += "0 ";
    for (int f = 0; f < frames; ++f) text += line + "\n";
    return text;
  };
  const size_t channels = parse_bvh(good, "x.bvh").channel_count;
  EXPECT_EQ(complaint(recording(head, channels, 100)), "");
  EXPECT_HAS(complaint(recording(head, channels, 5000)), "far more than is in the file");
  std::string still;
  for (int i = 0; i < 3000; ++i) still += "JOINT x" + std::to_string(i) + "\n{\nOFFSET 0 1 0\n}\n";
  const size_t at = head.rfind('}');
  const std::string crowd = head.substr(0, at) + still + head.substr(at);
  EXPECT_EQ(complaint(recording(crowd, channels, 10)), "");
  EXPECT_HAS(complaint(recording(crowd, channels, 500)), "of 3022 joints, far more");
}

}  // namespace
}  // namespace restage
