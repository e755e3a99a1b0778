// Parts of the open benchmark that need no data: recipe, floor, frames, manifest, realism.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "datasets/benchmark/floor.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/benchmark/realism.h"
#include "datasets/benchmark/recipe.h"
#include "datasets/benchmark/scans.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/readers/sha256.h"
#include "datasets/sampling/frames.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

using test::TempDir;
using test::write_bytes;

// ---- recipe ------------------------------------------------------------------------------------

BenchmarkRecipe small_recipe() {
  BenchmarkRecipe r;
  r.train = {{"b000"}, {"01_01"}};
  r.validation = {{"b120"}, {"08_01"}};
  r.test = {{"b140"}, {"02_01"}};
  r.characters = {{"female", "", {}, "", 0}, {"male", "b141", {}, "", 0}};
  r.motions = {{"walking", "02_01", 0, 20}};
  r.naked = {{"female", "male", {}}};
  r.scanners = {ScannerRecipe{}};
  r.scanners[0].id = "rig";
  r.scans = {{"rig", "walking", "female", "male", "", false}};
  return r;
}

TEST(BenchmarkRecipe, IsCheckedAsAWhole) {
  EXPECT_NO_THROW(check_recipe(small_recipe(), "r.yaml"));
  using Spoil = std::function<void(BenchmarkRecipe&)>;
  const std::pair<const char*, Spoil> cases[] = {
      {"'b000' is in train and in test", [](auto& r) { r.test.bodies.push_back("b000"); }},
      {"'08_01' is in validation and in test", [](auto& r) { r.test.clips.push_back("08_01"); }},
      {"of a test set is in train", [](auto& r) { r.characters[1].body = "b000"; }},
      {"of a test set is in validation", [](auto& r) { r.motions[0].clip = "08_01"; }},
      {"cannot be the id of a character", [](auto& r) { r.characters[0].id = "../x"; }},
      {"cannot be the id of a motion", [](auto& r) { r.motions[0].id = "a-b"; }},
      {"is there twice", [](auto& r) { r.characters[1].id = "female"; }},
      {"no character 'nobody'", [](auto& r) { r.naked[0].target = "nobody"; }},
      {"no motion 'flying'", [](auto& r) { r.naked[0].motions = {"flying"}; }},
      {"no scanner 'x'", [](auto& r) { r.scans[0].scanner = "x"; }},
      {"no character 'ghost'", [](auto& r) { r.scans[0].intruder = "ghost"; }}};
  for (const auto& [words, spoil] : cases) {
    BenchmarkRecipe r = small_recipe();
    spoil(r);
    try {
      check_recipe(r, "r.yaml");
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find("r.yaml: "), 0u);
    }
  }
}

// ---- floor -------------------------------------------------------------------------------------

TEST(BenchmarkFloor, EnvelopeStaysBelowAndFollowsDriftButNotJumps) {
  std::vector<double> heights(300);
  for (size_t i = 0; i < heights.size(); ++i) {
    const double t = static_cast<double>(i) / 30;
    heights[i] = 0.05 * std::sin(0.3 * t) + 0.03 * std::abs(std::sin(9 * t));  // drift and steps
  }
  for (size_t i = 150; i < 162; ++i) heights[i] += 0.4;  // 0.4 s in the air
  const std::vector<double> floor = lower_envelope(heights, 15);
  for (size_t i = 0; i < floor.size(); ++i) {
    ASSERT_LE(floor[i], heights[i]);
    EXPECT_NEAR(floor[i], 0.05 * std::sin(0.01 * static_cast<double>(i)), 0.02) << i;
  }
}

TEST(BenchmarkFloor, AMotionIsPutOnTheFloor) {
  const Body body = builtin_body(0, "test", 0);
  const std::vector<int32_t> vertices = outermost_vertices(body);
  EXPECT_GT(vertices.size(), 100u);
  EXPECT_LT(vertices.size(), body.rest.vertices.size());
  Motion motion = builtin_motions(0, 0, 0, 1)[0];
  const Motion before = motion;
  for (size_t f = 0; f < motion.frames(); ++f)
    motion.hips[f].y() +=
        0.1f * static_cast<float>(f) / static_cast<float>(motion.frames()) - 0.07f;
  const Motion after = on_floor(motion, body, vertices, 1);
  const std::vector<double> heights = lowest_heights(after, body, vertices);
  size_t touching = 0;
  for (size_t f = 0; f < heights.size(); ++f) {
    EXPECT_GT(heights[f], -1e-5);
    touching += heights[f] < 0.02;
    EXPECT_EQ(after.hips[f].x(), motion.hips[f].x());
    EXPECT_EQ(after.hips[f].z(), motion.hips[f].z());
  }
  EXPECT_GT(touching, heights.size() / 3);
  EXPECT_EQ(on_floor(motion, body, vertices, 0).hips, motion.hips) << "0: as recorded";
  EXPECT_EQ(before.global.size(), after.global.size());
}

TEST(BenchmarkFloor, OutermostVerticesHoldTheLowestPoint) {
  const Body body = builtin_body(1, "test", 0);
  const Motion motion = builtin_motions(3, 0, 0, 1)[0];
  const std::vector<int32_t> vertices = outermost_vertices(body);
  for (size_t f = 0; f < motion.frames(); f += 20) {
    const auto lowest = [&](const std::vector<int32_t>* pick) {
      double y = 1e9;
      for (const Point& p : pose_surface(body, pose_on(motion, body, f), pick))
        y = std::min(y, static_cast<double>(p.y()));
      return y;
    };
    EXPECT_NEAR(lowest(&vertices), lowest(nullptr), 0.02) << f;
  }
}

// ---- frames of scanners and of training
// ----------------------------------------------------------

TEST(BenchmarkScans, DrawnFramesAreSimilaritiesThatKeepTheHand) {
  int upright = 0;
  for (uint64_t i = 0; i < 200; ++i) {
    const SourceToWorld t = draw_frame({i, 7});
    const Mat3 a = t.leftCols<3>();
    const double unit = std::cbrt(a.determinant());
    ASSERT_GT(unit, 0);
    EXPECT_LT((a * a.transpose() - unit * unit * Mat3::Identity()).norm(), 1e-12);
    // One of the scanner's axes stands upright.
    EXPECT_NEAR(a.row(1).cwiseAbs().maxCoeff(), unit, 1e-9);
    upright += std::abs(a(1, 1) - unit) < 1e-9;
    EXPECT_LE(t.col(3).cwiseAbs().maxCoeff(), 2);
  }
  EXPECT_GT(upright, 10);  // y up: one of six
  EXPECT_LT(upright, 70);
}

TEST(SamplingFrames, AStepTakesOneFramePerSecond) {
  std::vector<Motion> motions(3);
  for (const auto& [m, frames] : {std::pair{0, 61}, std::pair{1, 10}, std::pair{2, 90}})
    motions[static_cast<size_t>(m)].global.resize(static_cast<size_t>(frames));
  const FrameIndex index(motions, 1, 30);
  ASSERT_EQ(index.count(), 3u + 1u + 3u);
  const std::pair<size_t, size_t> expected[] = {{0, 0}, {0, 30}, {0, 60}, {1, 0},
                                                {2, 0}, {2, 30}, {2, 60}};
  for (uint64_t i = 0; i < 7; ++i) {
    EXPECT_EQ(index.at(i).motion, expected[i].first);
    EXPECT_EQ(index.at(i).frame, expected[i].second);
  }
  EXPECT_EQ(FrameIndex(motions).count(), 161u);
}

// ---- manifest
// ------------------------------------------------------------------------------------

TEST(BenchmarkManifest, Sha256IsTheStandards) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const TempDir dir;
  write_bytes(dir / "million", std::string(1'000'000, 'a'));
  EXPECT_EQ(sha256_of_file(dir / "million"),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_THROW(sha256_of_file(dir / "none"), InputError);
}

TEST(BenchmarkManifest, EveryChangeIsFound) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "naked/a");
  write_bytes(dir / "naked/a/target.ply", "ply");
  write_bytes(dir / "recipe.yaml", "seed: 0\n");
  Manifest manifest;
  manifest.protocol = "p";
  manifest.seed = 3;
  manifest.license = "l";
  manifest.files = describe_files(dir.path());
  ASSERT_EQ(manifest.files.size(), 2u);
  write_manifest(dir.path(), manifest);
  const Manifest back = read_manifest(dir.path());
  EXPECT_EQ(back.seed, 3u);
  EXPECT_EQ(back.files.at("naked/a/target.ply").bytes, 3u);
  EXPECT_TRUE(verify_benchmark(dir.path()).empty());

  const auto problem = [&](const std::string& words) {
    const std::vector<std::string> found = verify_benchmark(dir.path());
    ASSERT_EQ(found.size(), 1u) << words;
    EXPECT_NE(found[0].find(words), std::string::npos) << found[0];
  };
  write_bytes(dir / "naked/a/target.ply", "plY");
  problem("is not what the manifest says");
  write_bytes(dir / "naked/a/target.ply", "longer");
  problem("has 6 bytes instead of 3");
  std::filesystem::remove(dir / "naked/a/target.ply");
  problem("is missing");
  write_bytes(dir / "naked/a/target.ply", "ply");
  write_bytes(dir / "naked/stray", "x");
  problem("is not in the manifest");
}

TEST(BenchmarkManifest, HostileManifestsAreRefused) {
  const TempDir dir;
  EXPECT_THROW(read_manifest(dir.path()), InputError);
  const std::string sum(64, 'a');
  const auto text = [&](const std::string& name, const std::string& hash) {
    return R"({"restage_benchmark": 1, "protocol": "p", "seed": 0, "license": "l", "provenance": "",)"
           R"( "inputs": {}, "files": {")" +
           name + R"(": {"sha256": ")" + hash + R"(", "bytes": 1}}})";
  };
  for (const std::string& bad :
       {std::string("{"), std::string("[]"), std::string("{\"restage_benchmark\": 2}"),
        std::string("{\"restage_benchmark\": \"1\"}"), text("../outside", sum),
        text("/etc/passwd", sum), text("a/../../b", sum), text("a", "short"), text("", sum),
        text("a", sum.substr(1) + "G")}) {
    write_bytes(dir / "manifest.json", bad);
    EXPECT_THROW(read_manifest(dir.path()), InputError) << bad;
  }
  write_bytes(dir / "manifest.json", text("a", sum));
  EXPECT_EQ(read_manifest(dir.path()).files.size(), 1u);
}

// ---- realism
// -------------------------------------------------------------------------------------

TEST(BenchmarkRealism, WindingNumberTellsInsideFromOutside) {
  const Body body = builtin_body(0, "test", 0);
  const auto at = [&](const Vec3& x) {
    return winding_number(body.rest.vertices, body.rest.faces, x);
  };
  EXPECT_NEAR(at(body.joints[0]), 1, 1e-3);
  EXPECT_NEAR(at(Vec3(0, 1, 2)), 0, 1e-3);
  std::vector<std::string> outside;
  Joints joints = body.joints;
  EXPECT_EQ(joints_inside(body, body.rest.vertices, joints), kJoints);
  joints[4] += Vec3(0, 0, 0.5);
  EXPECT_EQ(joints_inside(body, body.rest.vertices, joints, &outside), kJoints - 1);
  EXPECT_EQ(outside, std::vector<std::string>{"left_knee"});
  EXPECT_LT(buried_share(body, 40), 0.05);
}

TEST(BenchmarkRealism, KneesAndElbowsKeepMoreVolumeThanLinearBlendingLeaves) {
  const Body body = builtin_body(0, "test", 0);
  for (const auto& [near, joint, far] : {std::array{1, 4, 7}, std::array{17, 19, 21}}) {
    EXPECT_NEAR(bent_volume(body, near, joint, far, 0).ours, 1, 1e-4);
    const BentVolume bent = bent_volume(body, near, joint, far, std::numbers::pi / 2);
    EXPECT_GT(bent.ours, bent.linear);
    EXPECT_GT(bent.ours, 0.8);
  }
}

TEST(BenchmarkRealism, FeetThatFloatAndSlideAreMeasured) {
  const Body body = builtin_body(0, "test", 0);
  Motion motion = builtin_motions(0, 0, 0, 1)[0];
  const auto still = motion.global[0];
  for (size_t f = 0; f < motion.frames(); ++f) {
    motion.global[f] = still;
    motion.hips[f] = Point(0.01f * static_cast<float>(f), motion.hips[0].y(), 0);
  }
  const std::vector<int32_t> vertices = outermost_vertices(body);
  motion = on_floor(motion, body, vertices, 1);
  const FootContact contact = foot_contact(motion, body, vertices);
  for (const double y : contact.lowest) EXPECT_NEAR(y, 0, 1e-5);
  ASSERT_FALSE(contact.slipping.empty());
  const double scale = pose_on(motion, body, 1).root.x() - pose_on(motion, body, 0).root.x();
  for (const double speed : contact.slipping) EXPECT_NEAR(speed, 30 * scale, 1e-3);
  const RealismReport report = measure_realism({body}, {motion});
  EXPECT_EQ(report.frames, motion.frames());
  EXPECT_EQ(report.on_floor, 1);
  EXPECT_NEAR(report.slipping, 30 * scale, 1e-3);
}

}  // namespace
}  // namespace restage
