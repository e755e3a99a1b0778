// BVH import on files written by the test: every style of the same motion gives the same motion.
#include <gtest/gtest.h>
#include <lzma.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/importers/bvh.h"
#include "tests/datasets/importers_bvh_text.h"

namespace restage {
namespace {

using bvh_test::Style;

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

TEST(ImportersBvh, AnyChannelOrder) {
  for (const std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"})
    for (const bool first : {false, true}) {
      Style style;
      style.rotations = order;
      style.root_rotations = std::string(order.rbegin(), order.rend());
      style.rotations_first = first;
      style.frames = 41;
      expect_motion(convert(style), 11, order);
    }
}

TEST(ImportersBvh, AnyJointOrderAndHierarchy) {
  Style style;
  style.reversed = true;
  expect_motion(convert(style), 31, "reversed");
  style.all_positions = true;
  expect_motion(convert(style), 31, "positions of all joints");
  style.wrapped = true;
  expect_motion(convert(style), 31, "hips below a reference joint");
}

TEST(ImportersBvh, AnyFrameRateIsTrulyResampled) {
  for (const double fps : {24.0, 25.0, 29.97, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0}) {
    Style style;
    style.fps = fps;
    style.frames = static_cast<int>(std::floor(fps + 1e-9)) + 1;
    const double last = (style.frames - 1) / fps;
    const size_t frames = static_cast<size_t>(std::floor(last * 30 + 1e-3)) + 1;
    expect_motion(convert(style), frames, "fps " + std::to_string(fps));
  }
  Style wrong;  // the file says 120, the recording was made at 60
  wrong.fps = 60;
  std::string text = bvh_test::text(wrong);
  text.replace(text.find("0.0166666667"), 12, "0.00833333");
  MotionOptions options;
  options.fps = 60;
  options.drop_leading = 0;
  expect_motion(convert_bvh(text, "test.bvh", options), 61, "given fps");
}

TEST(ImportersBvh, AnyUnitAndUpAxisAndFacing) {
  for (const double unit : {1.0, 0.1, 0.0254 / 0.45, 0.0254, 0.01, 0.001}) {
    Style style;
    style.unit = unit;
    const MotionClip clip = convert(style);
    EXPECT_DOUBLE_EQ(clip.scale, unit);
    expect_motion(clip, 31, "unit " + std::to_string(unit));
  }
  for (const bool z_up : {false, true})
    for (const int turns : {0, 1, 2, 3}) {
      Style style;
      style.z_up = z_up;
      style.quarter_turns = turns;
      expect_motion(convert(style), 31, "z_up, turns");
    }
  Style odd;
  odd.unit = 0.0254 * 12 * 3;  // yards: a leg of 0.9 units would pass for metres, so by hand
  MotionOptions options;
  options.scale = odd.unit;
  expect_motion(convert(odd, options), 31, "yards");
  odd.unit = 0.2;
  EXPECT_NO_THROW(convert(odd));  // a leg of 4.2 units: decimetres by the rule
  odd.unit = 0.4;
  EXPECT_THROW(convert(odd), InputError);  // 2.1 units: nobody's leg
}

TEST(ImportersBvh, ZeroPoseThatIsNoTPoseIsReplacedByARestFrameOrBuilt) {
  Style style;
  style.t_pose_first = true;
  style.frames = 122;
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
  const auto facts = convert(style, options).report.facts;
  EXPECT_TRUE(std::any_of(facts.begin(), facts.end(), [](const auto& fact) {
    return fact.first == "rest pose" && fact.second.starts_with("built");
  }));
  options.rest.frame = 500;
  EXPECT_THROW(convert(style, options), InputError);
}

TEST(ImportersBvh, MissingSpineNeckCollarsAndToesArePlaced) {
  Style style;
  style.without = {6, 9, 12, 13, 14, 10, 11};
  const MotionClip clip = convert(style);
  const Joints& rest = clip.motion.rest;
  EXPECT_LT((rest[10] - (bvh_test::rest()[10] - bvh_test::rest()[0])).norm(),
            1e-5);  // the end site
  for (const auto& [below, above] : {std::pair{3, 6}, {6, 9}, {9, 12}, {12, 15}})
    EXPECT_GT(rest[above].y(), rest[below].y() + 0.02) << below;
  EXPECT_GT(rest[13].x(), 0.0);
  EXPECT_LT(rest[13].x(), rest[16].x());
  for (size_t f = 0; f < clip.motion.frames(); ++f)
    EXPECT_LT(clip.motion.global[f][9].angularDistance(clip.motion.global[f][3]), 1e-6);
  style.without = {15};
  try {
    convert(style);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lacks Head"), std::string::npos) << error.what();
  }
}

TEST(ImportersBvh, LeadingAndKeptFrames) {
  Style style;
  MotionOptions options;
  options.drop_leading = 20;
  options.keep_frames = 41;
  const MotionClip clip = convert(style, options);
  ASSERT_EQ(clip.motion.frames(), 11u);
  EXPECT_LT((clip.joints[0][21] - bvh_test::truth(20 / 120.0).joints[21]).norm(), 2e-5);
  options.drop_leading = 121;
  EXPECT_THROW(convert(style, options), InputError);
}

TEST(ImportersBvh, JumpingRootIsRefused) {
  Style style;
  style.frames = 5;
  std::string text = bvh_test::text(style);
  const size_t line = text.rfind('\n', text.size() - 2) + 2;
  text.insert(line, "9");  // hips of the last frame metres away
  try {
    convert_bvh(text, "test.bvh");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("frame 3 to 4"), std::string::npos) << error.what();
  }
  MotionOptions options;
  options.max_root_speed = 0;
  EXPECT_NO_THROW(convert_bvh(text, "test.bvh", options));
}

TEST(ImportersBvh, ReadsPlainAndXzFiles) {
  const std::string folder = ::testing::TempDir();
  const std::string plain = folder + "importers_07_01.bvh", packed = plain + ".xz";
  const std::string text = bvh_test::text(Style());
  std::ofstream(plain, std::ios::binary) << text;
  std::string xz(text.size() + 1024, '\0');
  size_t size = 0;
  ASSERT_EQ(lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr,
                                    reinterpret_cast<const uint8_t*>(text.data()), text.size(),
                                    reinterpret_cast<uint8_t*>(xz.data()), &size, xz.size()),
            LZMA_OK);
  xz.resize(size);
  std::ofstream(packed, std::ios::binary) << xz;
  MotionOptions options;
  options.drop_leading = 0;
  expect_motion(read_bvh(plain, options), 31, "plain");
  expect_motion(read_bvh(packed, options), 31, "xz");
  EXPECT_EQ(read_bvh(packed, options).motion.id, "importers_07_01");
  std::ofstream(packed, std::ios::binary) << xz.substr(0, xz.size() / 2);
  EXPECT_THROW(read_bvh(packed, options), InputError);
  EXPECT_THROW(read_bvh(folder + "no_such.bvh"), InputError);
  std::filesystem::remove(plain);
  std::filesystem::remove(packed);
}

TEST(ImportersBvh, BadFilesAreNamedWithTheirLine) {
  const std::string good = bvh_test::text(Style());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const std::string motion = good.substr(good.find("MOTION"));
  const std::vector<std::string> bad = {"",
                                        "\n\n",
                                        "HIERARCHY",
                                        "RIFF\x01\x02",
                                        good.substr(0, good.size() / 2),
                                        good.substr(0, good.find("MOTION")),
                                        good + "1 2 3\n",
                                        good.substr(0, good.rfind('\n', good.size() - 2) + 1),
                                        with("Frames: 121", "Frames: 0"),
                                        with("Frames: 121", "Frames: 99999999999999999999"),
                                        with("Frames: 121", "Frames: -1"),
                                        with("Frames: 121", "Frames: nan"),
                                        with("Frame Time: 0.0083", "Frame Time: 9990.0083"),
                                        with("Frame Time: 0.0083", "Frame Time: -0.0083"),
                                        with("OFFSET", "OFFSET 1"),
                                        with("OFFSET 0", "OFFSET x"),
                                        with("OFFSET 0", "OFFSET inf"),
                                        with("CHANNELS 6", "CHANNELS 7"),
                                        with("CHANNELS 6", "CHANNELS 99999999999"),
                                        with("Xposition", "Wposition"),
                                        with("Yposition", "Xposition"),
                                        with("JOINT", "ROOT"),
                                        with("{\n", "\n"),
                                        with("}\n", "\n"),
                                        with("}\n", "}\n}\n"),
                                        with("End Site", "JOINT"),
                                        with("ROOT mixamorig:Hips", "ROOT"),
                                        with("HIERARCHY\n", "HIERARCHY\n{\n"),
                                        with("HIERARCHY\n", "HIERARCHY\nOFFSET 0 0 0\n"),
                                        "HIERARCHY\n" + motion};
  for (const std::string& text : bad) {
    try {
      convert_bvh(text, "some.bvh");
      ADD_FAILURE() << text.substr(0, 300);
    } catch (const InputError& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.find("some.bvh:"), 0u) << what;
      EXPECT_LT(what.size(), 400u) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }
}

TEST(ImportersBvh, MutatedFilesNeverCrash) {
  Style style;
  style.frames = 6;
  const std::string good = bvh_test::text(style);
  const std::string pieces[] = {"nan",
                                "-",
                                "1e308",
                                "{",
                                "}",
                                "JOINT x\n",
                                "End Site\n",
                                "CHANNELS 3\n",
                                "\0x",
                                "1e9",
                                "OFFSET 0 0 0\n",
                                "MOTION\n",
                                "Frames: 4\n",
                                " ",
                                "\n",
                                "999999999999"};
  const RngKey key{7, 1};
  int usable = 0;
  for (uint64_t i = 0; i < 400; ++i) {
    Rng rng(key.fold(i));
    std::string text = good;
    for (uint64_t n = 1 + rng.below(3); n > 0; --n) {
      const size_t at = rng.below(text.size());
      const uint64_t kind = rng.below(5);
      if (kind == 0)
        text[at] = static_cast<char>(rng.below(256));
      else if (kind == 1)
        text.erase(at, 1 + rng.below(60));
      else if (kind == 2)
        text.insert(at, pieces[rng.below(std::size(pieces))]);
      else if (kind == 3)
        text.insert(at, text.substr(rng.below(text.size()), rng.below(200)));
      else
        text.resize(at + 1);
    }
    try {
      const MotionClip clip = convert_bvh(text, "fuzz.bvh");
      ++usable;
      for (const Joints& joints : clip.joints)
        for (const Vec3& x : joints) ASSERT_TRUE(x.allFinite()) << i;
    } catch (const InputError& error) {
      ASSERT_LT(std::string(error.what()).size(), 400u) << error.what();
    }
  }
  EXPECT_GT(usable, 0);  // some changes only alter a number
}

}  // namespace
}  // namespace restage
