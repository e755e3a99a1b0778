// The open benchmark: its recipe, floor, frames, manifest and realism, and the whole of it built
// small from the data folder.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "datasets/benchmark/build.h"
#include "datasets/benchmark/characters.h"
#include "datasets/benchmark/floor.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/benchmark/realism.h"
#include "datasets/benchmark/scans.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/readers/sha256.h"
#include "datasets/sampling/frames.h"
#include "datasets/schema.h"
#include "tests/support/data_folder.h"
#include "tests/support/files.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using BenchmarkManifest = FileTest;

BenchmarkRecipe small_recipe() {
  BenchmarkRecipe r;
  r.rotations = true;
  r.train = {{"b000", "b001"}, {"13_11"}};
  r.validation = {{"b120"}, {"08_01"}};
  r.test = {{"b140"}, {"02_03", "06_14"}};
  r.characters = {{"skinny", "", {.muscle = 0.25, .weight = 0}, "", 0},
                  {"dressed", "b147", {}, "female_sportsuit01", 0.03}};
  r.motions = {{"walking", "02_01", 10, 20}, {"throw", "06_15", 60, 20}};
  r.naked = {{"dressed", "skinny", {"walking"}}};
  r.clothed = {{"skinny", "dressed", {"throw"}}};
  ScannerRecipe scanner;
  scanner.id = "depth";
  scanner.pixels = 120;
  r.scanners = {scanner};
  r.scans = {{"depth", "walking", "dressed", "skinny", "skinny", false},
             {"depth", "throw", "dressed", "skinny", "", true}};
  return r;
}

using Spoil = std::function<void(BenchmarkRecipe&)>;

// ---- recipe

TEST(BenchmarkRecipe, IsCheckedAsAWhole) {
  EXPECT_NO_THROW(check_recipe(small_recipe(), "r.yaml"));
  const std::pair<Spoil, const char*> cases[] = {
      {[](auto& r) { r.test.bodies.push_back("b000"); }, "'b000' is in train and in test"},
      {[](auto& r) { r.test.clips.push_back("08_01"); }, "'08_01' is in validation and in test"},
      {[](auto& r) { r.characters[1].body = "b000"; }, "of a test set is in train"},
      {[](auto& r) { r.motions[0].clip = "08_01"; }, "of a test set is in validation"},
      {[](auto& r) { r.characters[0].id = "../x"; }, "cannot be the id of a character"},
      {[](auto& r) { r.motions[0].id = "a-b"; }, "cannot be the id of a motion"},
      {[](auto& r) { r.characters[1].id = r.characters[0].id; }, "is there twice"},
      {[](auto& r) {
         r.more = {{"../x.h5", true, {}}};
       },
       "no plain path"},
      {[](auto& r) {
         r.more = {{"./x.h5", true, {}}};
       },
       "no plain path"},
      {[](auto& r) {
         r.more = {{"/x.h5", true, {}}};
       },
       "no plain path"},
      {[](auto& r) {
         r.more = {{"", true, {}}};
       },
       "no plain path"},
      {[](auto& r) {
         r.more = {{"x.h5", true, {}}, {"x.h5", true, {}}};
       },
       "is there twice"},
      {[](auto& r) {
         r.more = {{"cmu/clips30.h5", true, {}}};
       },
       "is read anyway"},
      {[](auto& r) {
         r.more = {{"x.h5", true, {""}}};
       },
       "an empty text"},
      {[](auto& r) { r.vertices = 500; }, "wears a garment"},
      {[](auto& r) { r.characters.clear(), r.vertices = 10; }, "10 vertices"},
      {[](auto& r) { r.naked[0].target = "nobody"; }, "no character 'nobody'"},
      {[](auto& r) { r.naked[0].motions = {"flying"}; }, "no motion 'flying'"},
      {[](auto& r) { r.scans[0].scanner = "x"; }, "no scanner 'x'"},
      {[](auto& r) { r.scans[0].intruder = "ghost"; }, "no character 'ghost'"}};
  for (const auto& [spoil, words] : cases) {
    BenchmarkRecipe r = small_recipe();
    spoil(r);
    expect_refused([&] { check_recipe(r, "r.yaml"); }, "r.yaml: ", words);
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

TEST_F(BenchmarkManifest, Sha256IsTheStandards) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of_file(dir.write("million", std::string(1'000'000, 'a'))),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_THROW(sha256_of_file(dir / "none"), InputError);
}

TEST_F(BenchmarkManifest, EveryChangeIsFound) {
  dir.write("naked/a/target.ply", "ply");
  dir.write("recipe.yaml", "seed: 0\n");
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

  const auto problem = [&] {
    const std::vector<std::string> found = verify_benchmark(dir.path());
    return found.size() == 1 ? found[0] : std::to_string(found.size()) + " problems";
  };
  dir.write("naked/a/target.ply", "plY");
  EXPECT_HAS(problem(), "is not what the manifest says");
  dir.write("naked/a/target.ply", "longer");
  EXPECT_HAS(problem(), "has 6 bytes instead of 3");
  fs::remove(dir / "naked/a/target.ply");
  EXPECT_HAS(problem(), "is missing");
  dir.write("naked/a/target.ply", "ply");
  dir.write("naked/stray", "x");
  EXPECT_HAS(problem(), "is not in the manifest");
}

TEST_F(BenchmarkManifest, HostileManifestsAreRefused) {
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
    dir.write("manifest.json", bad);
    EXPECT_THROW(read_manifest(dir.path()), InputError) << bad;
  }
  dir.write("manifest.json", text("a", sum));
  EXPECT_EQ(read_manifest(dir.path()).files.size(), 1u);
}

// ---- realism

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
  EXPECT_EQ(outside, Names{"left_knee"});
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

// ---- the whole

class BenchmarkBuild : public FileTest {
 protected:
  void SetUp() override { RESTAGE_NEED_DATA(); }
  std::string build(const std::string& name, int with_threads,
                    const BenchmarkRecipe& recipe = small_recipe()) {
    const testing::UseThreads use(with_threads);
    build_benchmark(recipe, "text\n", "r.yaml", test::data_folder(), dir / name);
    return dir / name;
  }
};

TEST_F(BenchmarkBuild, SameBytesForAnyNumberOfThreadsAndVerified) {
  const std::string one = build("one", 1), two = build("two", 2);
  EXPECT_EQ(bytes_of(one + "/manifest.json"), bytes_of(two + "/manifest.json"));
  EXPECT_TRUE(verify_benchmark(one).empty());
  const Manifest manifest = read_manifest(one);
  EXPECT_EQ(manifest.files.size(), 3u + 1u + 4u * 4u);
  EXPECT_EQ(manifest.inputs.count("body/clothes/female_sportsuit01.mhclo.gz"), 1u);
  EXPECT_HAS(manifest.provenance, "mocap.cs.cmu.edu");
  for (const auto& [name, file] : manifest.files)
    if (name.ends_with(".h5")) {
      const Inspection found = inspect(one + "/" + name);
      EXPECT_HAS(found.provenance, "NSF EIA-0196217") << name;
      EXPECT_HAS(found.license, "CC0") << name;
    }
  EXPECT_EQ(names_in(dir.path()), (Names{"one", "two"}));
  BenchmarkRecipe other = small_recipe();
  other.seed = 1;
  other.rotations = false;
  const std::string three = build("three", 2, other);
  const char* truth = "/scans/walking-dressed-skinny-depth/truth.h5";
  EXPECT_TRUE(read_prediction(three + truth).rotations.empty());
  EXPECT_FALSE(read_prediction(one + truth).rotations.empty());
  EXPECT_NE(read_manifest(three).files.at("scans/walking-dressed-skinny-depth/source.h5").sha256,
            manifest.files.at("scans/walking-dressed-skinny-depth/source.h5").sha256);
}

TEST_F(BenchmarkBuild, MoreClipsAreForTrainingAlone) {
  const Manifest plain = read_manifest(build("plain", 2));
  BenchmarkRecipe recipe = small_recipe();
  recipe.more = {{"cmu_more/clips30_more.h5", true, {"wangzexi"}}};
  const std::string out = build("more", 2, recipe);
  EXPECT_TRUE(verify_benchmark(out).empty());
  EXPECT_EQ(read_motions(out + "/train.h5", "train").size(), 1u + 307u - 23u);
  const Manifest manifest = read_manifest(out);
  EXPECT_EQ(manifest.inputs.count("cmu_more/clips30_more.h5"), 1u);
  EXPECT_EQ(manifest.files.size(), plain.files.size());
  for (const auto& [name, file] : plain.files) {
    if (name == "train.h5" || name == "recipe.yaml") continue;
    EXPECT_EQ(manifest.files.at(name).sha256, file.sha256) << name;
  }
  recipe.more = {{"cmu_more/clips30_more.h5", false, {}}};
  recipe.motions.push_back({"roll", "127_23", 0, 20});
  recipe.naked = {{"dressed", "skinny", {"roll"}}};
  const std::string named = build("named", 2, recipe);
  EXPECT_EQ(read_motions(named + "/train.h5", "train").size(), 1u);
  EXPECT_EQ(read_prediction(named + "/naked/roll-dressed-skinny/truth.h5").frames, 20);
  recipe.more = {{"cmu_more/clips30_more.h5", true, {}}};
  expect_refused([&] { build("again", 2, recipe); }, "r.yaml: ", "'127_23' is of subject 127");
  recipe = small_recipe();
  recipe.train.clips.push_back("85_05");
  recipe.more = {{"cmu_more/clips30_more.h5", true, {}}};
  expect_refused([&] { build("again", 2, recipe); }, "r.yaml: ", "'85_05' is in train.clips");
  recipe.more = {{"cmu_more/none.h5", true, {}}};
  expect_refused([&] { build("again", 2, recipe); }, "r.yaml: ", "cmu_more/none.h5, which is not");
  recipe = small_recipe();
  recipe.characters[1].garment = "";
  recipe.vertices = 99999;
  expect_refused([&] { build("again", 2, recipe); }, "r.yaml: ", "takes none");
  EXPECT_FALSE(fs::exists(dir / "again"));
}

TEST_F(BenchmarkBuild, ASmallWorldKeepsTheSameVerticesOfAllBodies) {
  BenchmarkRecipe recipe = small_recipe();
  std::erase_if(recipe.characters, [](const auto& c) { return !c.garment.empty(); });
  recipe.naked = {{"skinny", "skinny", {"walking"}}};
  recipe.clothed.clear();
  recipe.scans.clear();
  recipe.vertices = 500;
  const std::string out = build("small", 2, recipe);
  EXPECT_TRUE(verify_benchmark(out).empty());
  const std::vector<Body> people = read_bodies(out + "/train.h5", "train");
  ASSERT_EQ(people.size(), 2u);
  for (const Body& body : people) {
    EXPECT_EQ(body.rest.vertices.size(), 500u);
    EXPECT_EQ(body.weights.rows(), 500);
    EXPECT_EQ(body.rest.faces, people[0].rest.faces) << "one topology";
    EXPECT_GT(body.rest.faces.size(), 900u);
  }
  const MakeHuman model(test::data_folder() + "/body");
  const std::vector<BodyRecipe> rows = read_recipes(test::data_folder() + "/body/bodies.csv");
  const Body whole = model.build(rows[0]);
  ASSERT_EQ(whole.id, people[0].id);
  EXPECT_EQ(whole.joints, people[0].joints);
  for (const Point& p : people[0].rest.vertices)
    EXPECT_NE(std::find(whole.rest.vertices.begin(), whole.rest.vertices.end(), p),
              whole.rest.vertices.end());
}

TEST_F(BenchmarkBuild, HoldsWhatTheRecipeSays) {
  const std::string out = build("out", 2);
  EXPECT_EQ(read_bodies(out + "/train.h5", "train").size(), 2u);
  EXPECT_EQ(read_motions(out + "/train.h5", "train").size(), 1u);
  EXPECT_EQ(read_bodies(out + "/validation.h5", "validation").size(), 1u);
  EXPECT_EQ(read_motions(out + "/test.h5", "test").size(), 2u);

  const std::string pair = out + "/clothed/throw-skinny-dressed";
  const Scans source = read_scans(pair + "/source.h5");
  const Prediction truth = read_prediction(pair + "/truth.h5");
  const Prediction rest = read_prediction(pair + "/rest.h5");
  EXPECT_EQ(source.frames(), 20);
  EXPECT_EQ(truth.frames, 20);
  EXPECT_EQ(rest.frames, 1);
  EXPECT_EQ(rest.vertex_count, truth.vertex_count);
  EXPECT_EQ(read_prediction(pair + "/source.h5").frames, 20) << "A's true joints";
  std::set<int64_t> counts;
  for (size_t f = 0; f < 20; ++f)
    counts.insert(source.frame_offset[f + 1] - source.frame_offset[f]);
  EXPECT_GT(counts.size(), 10u);
  // Lowest point of the truth on the floor, bones as long as at rest.
  double lowest = 1e9;
  for (size_t i = 1; i < truth.vertices.size(); i += 3)
    lowest = std::min(lowest, truth.vertices[i]);
  EXPECT_NEAR(lowest, 0, 0.03);
  const auto joint = [](const Prediction& p, size_t frame, size_t j) {
    const double* x = &p.joints[(frame * kJoints + j) * 3];
    return Vec3(x[0], x[1], x[2]);
  };
  for (size_t j = 1; j < kJoints; ++j) {
    const auto parent = static_cast<size_t>(kParents[j]);
    EXPECT_NEAR((joint(truth, 7, j) - joint(truth, 7, parent)).norm(),
                (joint(rest, 0, j) - joint(rest, 0, parent)).norm(), 1e-5);
    const double* q = &truth.rotations[(7 * kJoints + parent) * 4];
    const Vec3 bone = Quat(q[0], q[1], q[2], q[3]) * (joint(rest, 0, j) - joint(rest, 0, parent));
    EXPECT_LT((joint(truth, 7, j) - joint(truth, 7, parent) - bone).norm(), 1e-5);
  }
}

TEST_F(BenchmarkBuild, ScansComeBackIntoTheWorldByTheirTruth) {
  const std::string out = build("out", 2);
  for (const char* name : {"walking-dressed-skinny-depth", "throw-dressed-skinny-depth"}) {
    const std::string path = out + "/scans/" + name;
    const bool known = std::string(name).starts_with("throw");
    EXPECT_EQ(inspect(path + "/source.h5").units, known ? "metres" : "unknown");
    EXPECT_TRUE(verify(path + "/source.h5").empty());
    const std::vector<double> m =
        open_schema_file(path + "/truth.h5").read<double>("/source_to_world", {3, 4});
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> world(m.data());
    const Scans scans = read_scans(path + "/source.h5");
    const Prediction source = read_prediction(path + "/source.h5");
    for (size_t f = 0; f < 20; f += 5) {
      Vec3 mean = Vec3::Zero();
      const auto from = static_cast<size_t>(scans.frame_offset[f]),
                 to = static_cast<size_t>(scans.frame_offset[f + 1]);
      ASSERT_GT(to - from, 300u);
      size_t near = 0;
      for (size_t i = from; i < to; ++i) {
        const Vec3 p = world * scans.points[i].cast<double>().homogeneous();
        mean += p / static_cast<double>(to - from);
        near += p.y() > -0.1 && p.y() < 2.2;
      }
      EXPECT_GT(near, (to - from) * 98 / 100);
      const double* x = &source.joints[f * kJoints * 3];
      const Vec3 pelvis = world * Vec3(x[0], x[1], x[2]).homogeneous();
      EXPECT_NEAR(pelvis.y(), 0.9, 0.25);
      EXPECT_LT(std::hypot(mean.x() - pelvis.x(), mean.z() - pelvis.z()), 0.35);
    }
  }
}

TEST_F(BenchmarkBuild, ADressedCharacterIsWhole) {
  const MakeHuman model(test::data_folder() + "/body");
  const std::vector<BodyRecipe> rows = read_recipes(test::data_folder() + "/body/bodies.csv");
  const auto make = [&](const char* garment, double hair) {
    return make_character({"x", "b147", {}, garment, hair}, model, rows, {0, 0});
  };
  const Body bare = make("", 0), dressed = make("female_sportsuit01", 0);
  const Body hairy = make("female_sportsuit01", 0.04);
  EXPECT_LT(dressed.rest.vertices.size(), bare.rest.vertices.size());
  const auto extent = [](const Body& b) {
    Point low = b.rest.vertices[0], high = low;
    for (const Point& p : b.rest.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    return std::pair{low, high};
  };
  const auto [low, high] = extent(dressed);
  const auto [bare_low, bare_high] = extent(bare);
  EXPECT_NEAR(low.y(), 0, 1e-5);
  EXPECT_NEAR(high.y(), bare_high.y(), 0.01) << "the head is there";
  EXPECT_NEAR(high.x(), bare_high.x(), 0.01) << "and the hands";
  const float taller = extent(hairy).second.y() - high.y();
  EXPECT_GT(taller, 0.01f);
  EXPECT_LT(taller, 0.08f);
  ASSERT_EQ(hairy.rest.vertices.size(), dressed.rest.vertices.size());
  for (size_t v = 0; v < hairy.rest.vertices.size(); ++v)
    if (dressed.weights(static_cast<Eigen::Index>(v), 15) < 0.5f) {
      ASSERT_EQ(hairy.rest.vertices[v], dressed.rest.vertices[v]);
    }
}

TEST_F(BenchmarkBuild, WrongNamesAndTakenPlacesLeaveNothing) {
  const std::pair<Spoil, const char*> cases[] = {
      {[](auto& r) { r.train.bodies = {"b999"}; }, "no body 'b999'"},
      {[](auto& r) { r.test.clips = {"99_99"}; }, "no clip '99_99'"},
      {[](auto& r) { r.train.clips = {"02_02"}; }, "subject 02"},
      {[](auto& r) { r.motions[0].frames = 100000; }, "which has 86 frames"},
      {[](auto& r) { r.characters[1].garment = "../../secret"; }, "garment"}};
  for (const auto& [spoil, words] : cases) {
    BenchmarkRecipe r = small_recipe();
    spoil(r);
    expect_refused([&] { build_benchmark(r, "", "r.yaml", test::data_folder(), dir / "out"); }, "",
                   words);
    EXPECT_TRUE(names_in(dir.path()).empty());
  }
  fs::create_directories(dir / "taken/x");
  EXPECT_THROW(build_benchmark(small_recipe(), "", "r.yaml", test::data_folder(), dir / "taken"),
               InputError);
  EXPECT_THROW(build_benchmark(small_recipe(), "", "r.yaml", dir / "nothing", dir / "out"),
               InputError);
}

}  // namespace
}  // namespace restage
