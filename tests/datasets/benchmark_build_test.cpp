// The open benchmark built small from the data folder, and what fetching does.
#include <gtest/gtest.h>
#include <zlib.h>

#include <map>
#include <set>

#include "autograd/base/parallel.h"
#include "datasets/benchmark/build.h"
#include "datasets/benchmark/characters.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/fetch/fetch.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/cmu_pack.h"
#include "datasets/importers/makehuman_pack.h"
#include "datasets/readers/sha256.h"
#include "datasets/schema.h"
#include "tests/datasets/schema_support.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::TempDir;
using test::write_bytes;

BenchmarkRecipe small_recipe() {
  BenchmarkRecipe r;
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

class BenchmarkBuild : public ::testing::Test {
 protected:
  void SetUp() override { RESTAGE_NEED_DATA(); }
  void TearDown() override { set_threads(0); }
  std::string build(const std::string& name, int with_threads,
                    const BenchmarkRecipe& recipe = small_recipe()) {
    set_threads(with_threads);
    build_benchmark(recipe, "text\n", "r.yaml", test::data_folder(), dir_ / name);
    return dir_ / name;
  }
  TempDir dir_;
};

TEST_F(BenchmarkBuild, SameBytesForAnyNumberOfThreadsAndVerified) {
  const std::string one = build("one", 1), two = build("two", 2);
  EXPECT_EQ(bytes_of(one + "/manifest.json"), bytes_of(two + "/manifest.json"));
  EXPECT_TRUE(verify_benchmark(one).empty());
  const Manifest manifest = read_manifest(one);
  EXPECT_EQ(manifest.files.size(), 3u + 1u + 4u * 4u);
  EXPECT_EQ(manifest.inputs.count("body/clothes/female_sportsuit01.mhclo.gz"), 1u);
  EXPECT_NE(manifest.provenance.find("mocap.cs.cmu.edu"), std::string::npos);
  for (const auto& [name, file] : manifest.files)
    if (name.ends_with(".h5")) {
      const Inspection found = inspect(one + "/" + name);
      EXPECT_NE(found.provenance.find("NSF EIA-0196217"), std::string::npos) << name;
      EXPECT_NE(found.license.find("CC0"), std::string::npos) << name;
    }
  EXPECT_EQ(test::names_in(dir_.path()), (std::vector<std::string>{"one", "two"}));
  BenchmarkRecipe other = small_recipe();
  other.seed = 1;
  const std::string three = build("three", 2, other);
  EXPECT_NE(read_manifest(three).files.at("scans/walking-dressed-skinny-depth/source.h5").sha256,
            manifest.files.at("scans/walking-dressed-skinny-depth/source.h5").sha256);
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
  const auto refused = [&](const BenchmarkRecipe& r, const std::string& words) {
    try {
      build_benchmark(r, "", "r.yaml", test::data_folder(), dir_ / "out");
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
    EXPECT_TRUE(test::names_in(dir_.path()).empty());
  };
  BenchmarkRecipe r = small_recipe();
  r.train.bodies = {"b999"};
  refused(r, "no body 'b999'");
  r = small_recipe();
  r.test.clips = {"99_99"};
  refused(r, "no clip '99_99'");
  r = small_recipe();
  r.train.clips = {"02_02"};
  refused(r, "subject 02");
  r = small_recipe();
  r.motions[0].frames = 100000;
  refused(r, "which has 86 frames");
  r = small_recipe();
  r.characters[1].garment = "../../secret";
  refused(r, "garment");
  fs::create_directories(dir_ / "taken/x");
  EXPECT_THROW(build_benchmark(small_recipe(), "", "r.yaml", test::data_folder(), dir_ / "taken"),
               InputError);
  EXPECT_THROW(build_benchmark(small_recipe(), "", "r.yaml", dir_ / "nothing", dir_ / "out"),
               InputError);
}

// ---- fetch
// -----------------------------------------------------------------------------------------

std::string gzipped(const std::string& path, const std::string& content) {
  gzFile file = gzopen(path.c_str(), "wb1");
  gzwrite(file, content.data(), static_cast<unsigned>(content.size()));
  gzclose(file);
  return bytes_of(path);
}

class Fetch : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(dir_ / "origin"); }
  std::string line(const std::string& content, const std::string& path,
                   const std::string& address) {
    return sha256(content) + " " + std::to_string(content.size()) + " " + path + " " + address +
           "\n";
  }
  std::string list(const std::string& text) {
    write_bytes(dir_ / "list.txt", "# comment\n\n" + text);
    return dir_ / "list.txt";
  }
  std::string origin(const std::string& name, const std::string& content) {
    write_bytes(dir_ / ("origin/" + name), content);
    return "file://" + dir_.path() + "/origin/" + name;
  }
  TempDir dir_;
  const std::string big_ = std::string(100'000, 'x') + "end";
};

TEST_F(Fetch, AddressesAreCheckedPackedAndKept) {
  write_bytes(dir_ / "own.csv", "a,b\n");
  const std::string file =
      list(line(big_, "cmu/big.bin", origin("big", big_)) +
           line("v 0 0 0\n", "body/clothes/x.obj.gz", origin("x.obj", "v 0 0 0\n")) +
           line("a,b\n", "body/own.csv", "own.csv") + line("z", "packed.h5", "-"));
  const FetchSummary first = fetch_data(file, dir_ / "out");
  EXPECT_EQ(first.fetched, 3u);
  EXPECT_EQ(first.present, 0u);
  EXPECT_EQ(first.missing, std::vector<std::string>{"packed.h5"});
  EXPECT_EQ(bytes_of(dir_ / "out/cmu/big.bin"), big_);
  EXPECT_EQ(bytes_of(dir_ / "out/body/own.csv"), "a,b\n");
  EXPECT_EQ(bytes_of(dir_ / "out/body/clothes/x.obj.gz").substr(0, 2), "\x1f\x8b");
  EXPECT_EQ(test::names_in(dir_ / "out/cmu"), std::vector<std::string>{"big.bin"});
  const FetchSummary again = fetch_data(file, dir_ / "out");
  EXPECT_EQ(again.fetched, 0u);
  EXPECT_EQ(again.present, 3u);
}

TEST_F(Fetch, ACopyServesWithoutNetwork) {
  fs::create_directories(dir_ / "copy/body/clothes");
  fs::create_directories(dir_ / "copy/cmu");
  write_bytes(dir_ / "copy/cmu/big.bin", big_);
  const std::string packed = gzipped(dir_ / "copy/body/clothes/x.obj.gz", "v 0 0 0\n");
  const std::string file =
      list(line(big_, "cmu/big.bin", "-") +
           line("v 0 0 0\n", "body/clothes/x.obj.gz", "https://invalid.invalid/x.obj"));
  const FetchSummary done = fetch_data(file, dir_ / "out", dir_ / "copy");
  EXPECT_EQ(done.fetched, 2u);
  EXPECT_TRUE(done.missing.empty());
  EXPECT_EQ(bytes_of(dir_ / "out/body/clothes/x.obj.gz"), packed);
  write_bytes(dir_ / "copy/cmu/big.bin", big_ + "!");
  EXPECT_THROW(fetch_data(file, dir_ / "other", dir_ / "copy"), InputError);
  EXPECT_FALSE(fs::exists(dir_ / "other/cmu/big.bin"));
  EXPECT_THROW(fetch_data(file, dir_ / "other", dir_ / "none"), InputError);
}

/// MakeHuman's files with one quad, two bones and two targets.
std::map<std::string, std::string> tiny_makehuman() {
  return {{"base.obj",
           "# CC0\nv 0 0 0\nv 1 0 0\nv 1 1.5 0\nv 0 1 0\nv 9 9 9\ng body\nf 1/1 2/2 3/3 4/4\n"
           "g joint-head\nf 5/1 5/1 5/1 5/1\n"},
          {"targets/a/up-incr.target", "# CC0\n2 0 .25 -1\n4 0 1 0\n"},
          {"targets/none.target", "# CC0\n"},
          {"game_engine.mhskel",
           R"({"bones": {"Root": {"head": "r", "parent": null}, "pelvis": {"head": "p", "parent":
             "Root"}}, "joints": {"r": [0, 1], "p": [4]}})"},
          {"weights.game_engine.json", R"({"weights": {"Root": [], "pelvis": [[2, 0.5]]}})"}};
}

TEST_F(Fetch, MakeHumanIsPackedFromItsPublishedFiles) {
  std::string parts = "@here file://" + dir_.path() + "/origin\n";
  for (const auto& [name, content] : tiny_makehuman()) {
    fs::create_directories(fs::path(dir_ / ("origin/" + name)).parent_path());
    origin(name, content);
    parts += line(content, "body/makehuman/" + name, "@here/" + name);
  }
  write_bytes(dir_ / "parts.txt", parts);
  const std::string file = list(line("a copy", "body/makehuman.h5", "makehuman:parts.txt"));
  EXPECT_EQ(fetch_data(file, dir_ / "out").fetched, 1u);
  const std::string packed = bytes_of(dir_ / "out/body/makehuman.h5");
  const h5::File h5 = h5::File::open(dir_ / "out/body/makehuman.h5");
  EXPECT_EQ(h5.read<float>("/base/vertices", {5, 3})[7], 1.5f);
  EXPECT_EQ(h5.read<int32_t>("/base/body_quads", {-1, 4}), (std::vector<int32_t>{0, 1, 2, 3}));
  EXPECT_EQ(h5.dataset("/rig/bone_names").read_text(),
            (std::vector<std::string>{"Root", "pelvis"}));
  EXPECT_EQ(h5.read<int32_t>("/rig/bone_parent", {2}), (std::vector<int32_t>{-1, 0}));
  EXPECT_EQ(h5.read<int32_t>("/rig/head_vertices", {2, 2}), (std::vector<int32_t>{0, 1, 4, -1}));
  EXPECT_EQ(h5.read<int32_t>("/rig/weight_vertex", {1}), (std::vector<int32_t>{2}));
  EXPECT_EQ(h5.dataset("/targets/names").read_text(),
            (std::vector<std::string>{"a/up-incr", "none"}));
  EXPECT_EQ(h5.read<int64_t>("/targets/count", {2}), (std::vector<int64_t>{2, 0}));
  EXPECT_EQ(h5.read<int16_t>("/targets/delta_milli", {2, 3}),
            (std::vector<int16_t>{0, 250, -1000, 0, 1000, 0}));

  fetch_data(file, dir_ / "out");
  EXPECT_EQ(bytes_of(dir_ / "out/body/makehuman.h5"), packed) << "again gives the same";
  // A folder that has the published files serves as well; one that lacks a file does not.
  EXPECT_TRUE(fetch_data(file, dir_ / "copied", dir_ / "out").missing.empty());
  EXPECT_EQ(bytes_of(dir_ / "copied/body/makehuman.h5"), packed);
  fs::remove(dir_ / "out/body/makehuman/base.obj");
  EXPECT_THROW(fetch_data(file, dir_ / "other", dir_ / "out"), InputError) << "there, but another";
  fs::remove(dir_ / "out/body/makehuman.h5");
  EXPECT_EQ(fetch_data(file, dir_ / "other", dir_ / "out").missing,
            std::vector<std::string>{"body/makehuman.h5"});
  EXPECT_EQ(test::names_in(dir_ / "other"), std::vector<std::string>{}) << "nothing in part";
  write_bytes(dir_ / "parts.txt", line("a copy", "body/makehuman.h5", "makehuman:parts.txt"));
  EXPECT_THROW(fetch_data(file, dir_ / "endless"), InputError);
}

TEST_F(Fetch, BrokenMakeHumanFilesAreRefusedByLine) {
  const auto refused = [&](const std::string& name, const std::string& content,
                           const std::string& words) {
    std::map<std::string, std::string> files = tiny_makehuman();
    files[name] = content;
    const TempDir folder;
    for (const auto& [path, text] : files) {
      fs::create_directories(fs::path(folder / path).parent_path());
      write_bytes(folder / path, text);
    }
    try {
      pack_makehuman(folder.path(), folder / "out.h5");
      ADD_FAILURE() << name << ": " << content;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
    EXPECT_FALSE(fs::exists(folder / "out.h5"));
  };
  refused("base.obj", "v 0 0 0\ng body\nf 1 1 1 2\n", "base.obj:3");
  refused("base.obj", "v 0 0 0\ng body\nf 1 1 1\n", "no quad");
  refused("base.obj", "v 0 0 0\n", "no faces");
  refused("targets/none.target", "5 0 0 0\n", "none.target:1");
  refused("targets/none.target", "0 0 0\n", "vertex x y z");
  refused("targets/none.target", "0 0 40 0\n", "3 metres");
  refused("game_engine.mhskel", "{", "laid out");
  refused("game_engine.mhskel",
          R"({"bones": {"Root": {"head": "r", "parent": "x"}}, "joints": {"r": [0]}})", "a bone");
  refused("weights.game_engine.json", R"({"weights": {"pelvis": [[7, 0.5]]}})", "a vertex");
  refused("weights.game_engine.json", R"({"weights": {"pelvis": [[0, -1]]}})", "a weight");
}

TEST_F(Fetch, AtNamesMustBeExplained) {
  EXPECT_THROW(read_fetch_list(list(line("x", "a", "@who/a"))), InputError);
  EXPECT_THROW(read_fetch_list(list("@a x\n@a y\n" + line("x", "a", "@a/a"))), InputError);
  EXPECT_THROW(read_fetch_list(list("@a\n" + line("x", "a", "@a/a"))), InputError);
  EXPECT_EQ(read_fetch_list(list("@a https://b\n" + line("x", "a", "@a/c")))[0].address,
            "https://b/c");
}

TEST_F(Fetch, GoesOnWhereItBrokeOff) {
  const std::string file = list(line(big_, "big.bin", origin("big", big_)));
  fs::create_directories(dir_ / "out");
  write_bytes(dir_ / "out/big.bin.part", big_.substr(0, 60'000));
  // Only the rest is read: the beginning of the origin is not what it should be.
  origin("big", std::string(60'000, '?') + big_.substr(60'000));
  EXPECT_EQ(fetch_data(file, dir_ / "out").fetched, 1u);
  EXPECT_EQ(bytes_of(dir_ / "out/big.bin"), big_);
  EXPECT_FALSE(fs::exists(dir_ / "out/big.bin.part"));
}

TEST_F(Fetch, WhatIsNotPinnedNeverTakesItsPlace) {
  for (const std::string& arrives : {std::string("short"), big_.substr(1) + "!", big_ + "more"}) {
    const std::string file = list(line(big_, "big.bin", origin("big", arrives)));
    EXPECT_THROW(fetch_data(file, dir_ / "out"), WorkError);
    EXPECT_FALSE(fs::exists(dir_ / "out/big.bin"));
    fs::remove(dir_ / "out/big.bin.part");
  }
  try {
    fetch_data(list(line(big_, "big.bin", "file://" + dir_.path() + "/none")), dir_ / "out");
    ADD_FAILURE();
  } catch (const WorkError& error) {
    EXPECT_NE(std::string(error.what()).find("--from FOLDER"), std::string::npos);
  }
  EXPECT_THROW(fetch_data(list(line(big_, "a", "http://localhost:1/x")), dir_ / "out"), InputError)
      << "unencrypted";
}

TEST_F(Fetch, HostileListsAreRefusedWithTheirLine) {
  const std::string sum(64, 'a');
  for (const std::string& bad :
       {std::string("words"), sum + " 1 path", sum + " -1 path x", sum + " 1e3 path x",
        sum.substr(1) + " 1 path x", sum + " 1 ../path x", sum + " 1 /path x",
        sum + " 1 a/../../path x", sum + " 1 path x more",
        sum + " 1 path x\n" + sum + " 1 path y"}) {
    try {
      read_fetch_list(list(bad));
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("list.txt:"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(read_fetch_list(list("")), InputError);
  EXPECT_THROW(read_fetch_list(dir_ / "none"), InputError);
}

TEST(FetchList, TheProjectsOwnListsAreSound) {
  const std::string folder = RESTAGE_SOURCE_DIR "/configs/data/", packed = "makehuman:";
  const std::vector<FetchEntry> entries = read_fetch_list(folder + "open_data.txt");
  EXPECT_GT(entries.size(), 10u);
  for (const FetchEntry& e : entries) {
    if (e.address.find("://") != std::string::npos || e.address == "-") continue;
    if (e.address.starts_with("cmu:")) {
      for (const auto& [name, from] : read_cmu_originals(folder + e.address.substr(4)).repositories)
        EXPECT_TRUE(from.tree.starts_with("https://") && from.files.starts_with("https://"))
            << name;
      continue;
    }
    if (!e.address.starts_with(packed)) {
      EXPECT_EQ(sha256_of_file(folder + e.address), e.sha256);
      continue;
    }
    const std::vector<FetchEntry> parts = read_fetch_list(folder + e.address.substr(packed.size()));
    EXPECT_EQ(parts.size(), 555u);
    for (const FetchEntry& part : parts) {
      EXPECT_TRUE(part.address.starts_with("https://")) << part.address;
      EXPECT_TRUE(part.path.starts_with("body/makehuman/")) << part.path;
    }
  }
}

}  // namespace
}  // namespace restage
