// The data folder from public addresses: what fetching does, and MakeHuman's and CMU's files packed
// into those that read_cmu() and MakeHuman read.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "datasets/fetch/fetch.h"
#include "datasets/fetch/fetch_cmu.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/bodies/makehuman_pack.h"
#include "datasets/importers/motions/cmu.h"
#include "datasets/importers/motions/cmu_pack.h"
#include "datasets/readers/sha256.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/data_folder.h"
#include "tests/support/files.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;

const char* const kList = RESTAGE_SOURCE_DIR "/configs/data/cmu_originals.txt";

std::string gzipped(const std::string& path, const std::string& content) {
  gzFile file = gzopen(path.c_str(), "wb1");
  gzwrite(file, content.data(), static_cast<unsigned>(content.size()));
  gzclose(file);
  return bytes_of(path);
}

class Fetch : public FileTest {
 protected:
  std::string line(const std::string& content, const std::string& path,
                   const std::string& address) {
    return sha256(content) + " " + std::to_string(content.size()) + " " + path + " " + address +
           "\n";
  }
  std::string list(const std::string& text) {
    return dir.write("list.txt", "# comment\n\n" + text);
  }
  std::string origin(const std::string& name, const std::string& content) {
    return "file://" + dir.write("origin/" + name, content);
  }
  const std::string big_ = std::string(100'000, 'x') + "end";
};

TEST_F(Fetch, AddressesAreCheckedPackedAndKept) {
  dir.write("own.csv", "a,b\n");
  const std::string file =
      list(line(big_, "cmu/big.bin", origin("big", big_)) +
           line("v 0 0 0\n", "body/clothes/x.obj.gz", origin("x.obj", "v 0 0 0\n")) +
           line("a,b\n", "body/own.csv", "own.csv") + line("z", "packed.h5", "-"));
  const FetchSummary first = fetch_data(file, dir / "out");
  EXPECT_EQ(first.fetched, 3u);
  EXPECT_EQ(first.present, 0u);
  EXPECT_EQ(first.missing, Names{"packed.h5"});
  EXPECT_EQ(bytes_of(dir / "out/cmu/big.bin"), big_);
  EXPECT_EQ(bytes_of(dir / "out/body/own.csv"), "a,b\n");
  EXPECT_EQ(bytes_of(dir / "out/body/clothes/x.obj.gz").substr(0, 2), "\x1f\x8b");
  EXPECT_EQ(names_in(dir / "out/cmu"), Names{"big.bin"});
  const FetchSummary again = fetch_data(file, dir / "out");
  EXPECT_EQ(again.fetched, 0u);
  EXPECT_EQ(again.present, 3u);
}

TEST_F(Fetch, ACopyServesWithoutNetwork) {
  fs::create_directories(dir / "copy/body/clothes");
  dir.write("copy/cmu/big.bin", big_);
  const std::string packed = gzipped(dir / "copy/body/clothes/x.obj.gz", "v 0 0 0\n");
  const std::string file =
      list(line(big_, "cmu/big.bin", "-") +
           line("v 0 0 0\n", "body/clothes/x.obj.gz", "https://invalid.invalid/x.obj"));
  const FetchSummary done = fetch_data(file, dir / "out", dir / "copy");
  EXPECT_EQ(done.fetched, 2u);
  EXPECT_TRUE(done.missing.empty());
  EXPECT_EQ(bytes_of(dir / "out/body/clothes/x.obj.gz"), packed);
  dir.write("copy/cmu/big.bin", big_ + "!");
  EXPECT_THROW(fetch_data(file, dir / "other", dir / "copy"), InputError);
  EXPECT_FALSE(fs::exists(dir / "other/cmu/big.bin"));
  EXPECT_THROW(fetch_data(file, dir / "other", dir / "none"), InputError);
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
  std::string parts = "@here file://" + dir.path() + "/origin\n";
  for (const auto& [name, content] : tiny_makehuman()) {
    origin(name, content);
    parts += line(content, "body/makehuman/" + name, "@here/" + name);
  }
  dir.write("parts.txt", parts);
  const std::string file = list(line("a copy", "body/makehuman.h5", "makehuman:parts.txt"));
  EXPECT_EQ(fetch_data(file, dir / "out").fetched, 1u);
  const std::string packed = bytes_of(dir / "out/body/makehuman.h5");
  const h5::File h5 = h5::File::open(dir / "out/body/makehuman.h5");
  EXPECT_EQ(h5.read<float>("/base/vertices", {5, 3})[7], 1.5f);
  EXPECT_EQ(h5.read<int32_t>("/base/body_quads", {-1, 4}), (std::vector<int32_t>{0, 1, 2, 3}));
  EXPECT_EQ(h5.dataset("/rig/bone_names").read_text(), (Names{"Root", "pelvis"}));
  EXPECT_EQ(h5.read<int32_t>("/rig/bone_parent", {2}), (std::vector<int32_t>{-1, 0}));
  EXPECT_EQ(h5.read<int32_t>("/rig/head_vertices", {2, 2}), (std::vector<int32_t>{0, 1, 4, -1}));
  EXPECT_EQ(h5.read<int32_t>("/rig/weight_vertex", {1}), (std::vector<int32_t>{2}));
  EXPECT_EQ(h5.dataset("/targets/names").read_text(), (Names{"a/up-incr", "none"}));
  EXPECT_EQ(h5.read<int64_t>("/targets/count", {2}), (std::vector<int64_t>{2, 0}));
  EXPECT_EQ(h5.read<int16_t>("/targets/delta_milli", {2, 3}),
            (std::vector<int16_t>{0, 250, -1000, 0, 1000, 0}));

  fetch_data(file, dir / "out");
  EXPECT_EQ(bytes_of(dir / "out/body/makehuman.h5"), packed) << "again gives the same";
  // A folder that has the published files serves as well; one that lacks a file does not.
  EXPECT_TRUE(fetch_data(file, dir / "copied", dir / "out").missing.empty());
  EXPECT_EQ(bytes_of(dir / "copied/body/makehuman.h5"), packed);
  fs::remove(dir / "out/body/makehuman/base.obj");
  EXPECT_THROW(fetch_data(file, dir / "other", dir / "out"), InputError) << "there, but another";
  fs::remove(dir / "out/body/makehuman.h5");
  EXPECT_EQ(fetch_data(file, dir / "other", dir / "out").missing, Names{"body/makehuman.h5"});
  EXPECT_EQ(names_in(dir / "other"), Names{}) << "nothing in part";
  dir.write("parts.txt", line("a copy", "body/makehuman.h5", "makehuman:parts.txt"));
  EXPECT_THROW(fetch_data(file, dir / "endless"), InputError);
}

TEST_F(Fetch, BrokenMakeHumanFilesAreRefusedByLine) {
  struct Case {
    const char *name, *content, *says;
  };
  const char* const bones = "game_engine.mhskel";
  const char* const weights = "weights.game_engine.json";
  for (const auto& [name, content, says] : {
           Case{"base.obj", "v 0 0 0\ng body\nf 1 1 1 2\n", "base.obj:3"},
           {"base.obj", "v 0 0 0\ng body\nf 1 1 1\n", "no quad"},
           {"base.obj", "v 0 0 0\n", "no faces"},
           {"targets/none.target", "5 0 0 0\n", "none.target:1"},
           {"targets/none.target", "0 0 0\n", "vertex x y z"},
           {"targets/none.target", "0 0 40 0\n", "3 metres"},
           {bones, "{", "laid out"},
           {bones, R"({"bones": {"Root": {"head": "r", "parent": "x"}}, "joints": {"r": [0]}})",
            "a bone"},
           {weights, R"({"weights": {"pelvis": [[7, 0.5]]}})", "a vertex"},
           {weights, R"({"weights": {"pelvis": [[0, -1]]}})", "a weight"},
       }) {
    std::map<std::string, std::string> files = tiny_makehuman();
    files[name] = content;
    const TempDir folder;
    for (const auto& [path, text] : files) folder.write(path, text);
    EXPECT_HAS(error_of([&] { pack_makehuman(folder.path(), folder / "out.h5"); }), says);
    EXPECT_FALSE(fs::exists(folder / "out.h5"));
  }
}

TEST_F(Fetch, AtNamesMustBeExplained) {
  for (const std::string& bad : {line("x", "a", "@who/a"), "@a x\n@a y\n" + line("x", "a", "@a/a"),
                                 "@a\n" + line("x", "a", "@a/a")})
    EXPECT_THROW(read_fetch_list(list(bad)), InputError) << bad;
  EXPECT_EQ(read_fetch_list(list("@a https://b\n" + line("x", "a", "@a/c")))[0].address,
            "https://b/c");
}

TEST_F(Fetch, GoesOnWhereItBrokeOff) {
  const std::string file = list(line(big_, "big.bin", origin("big", big_)));
  dir.write("out/big.bin.part", big_.substr(0, 60'000));
  // Only the rest is read: the beginning of the origin is not what it should be.
  origin("big", std::string(60'000, '?') + big_.substr(60'000));
  EXPECT_EQ(fetch_data(file, dir / "out").fetched, 1u);
  EXPECT_EQ(bytes_of(dir / "out/big.bin"), big_);
  EXPECT_FALSE(fs::exists(dir / "out/big.bin.part"));
}

TEST_F(Fetch, WhatIsNotPinnedNeverTakesItsPlace) {
  for (const std::string& arrives : {std::string("short"), big_.substr(1) + "!", big_ + "more"}) {
    const std::string file = list(line(big_, "big.bin", origin("big", arrives)));
    EXPECT_THROW(fetch_data(file, dir / "out"), WorkError);
    EXPECT_FALSE(fs::exists(dir / "out/big.bin"));
    fs::remove(dir / "out/big.bin.part");
  }
  EXPECT_HAS(error_of<WorkError>([&] {
               fetch_data(list(line(big_, "big.bin", "file://" + dir.path() + "/none")),
                          dir / "out");
             }),
             "source FOLDER");
  EXPECT_THROW(fetch_data(list(line(big_, "a", "http://localhost:1/x")), dir / "out"), InputError)
      << "unencrypted";
}

TEST_F(Fetch, HostileListsAreRefusedWithTheirLine) {
  const std::string sum(64, 'a');
  for (const std::string& bad :
       {std::string("words"), sum + " 1 path", sum + " -1 path x", sum + " 1e3 path x",
        sum.substr(1) + " 1 path x", sum + " 1 ../path x", sum + " 1 /path x",
        sum + " 1 a/../../path x", sum + " 1 path x more",
        sum + " 1 path x\n" + sum + " 1 path y"}) {
    EXPECT_HAS(error_of([&] { read_fetch_list(list(bad)); }), "list.txt:");
  }
  EXPECT_THROW(read_fetch_list(list("")), InputError);
  EXPECT_THROW(read_fetch_list(dir / "none"), InputError);
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

// ---- CMU: two joints, five frames
// -------------------------------------------------------------------

/// Frame f stands at (f, 100, 0) and turns its hip by `degrees` about y.
std::string toy_bvh(const std::string& degrees = "90") {
  std::string out =
      "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
      "Xrotation Yrotation\nJOINT abdomen\n{\nOFFSET 0 20 0\nCHANNELS 3 Zrotation Xrotation "
      "Yrotation\nEnd Site\n{\nOFFSET 0 10 0\n}\n}\n}\nMOTION\nFrames: 5\nFrame Time: 0.0083333\n";
  for (int f = 0; f < 5; ++f) out += std::to_string(f) + " 100 0 0 0 " + degrees + " 0 0 0\n";
  return out;
}

/// Of frames 0, 2 and 4, by hand: abdomen before hip, as names go.
std::string toy_sum() {
  const auto all = [](auto... values) { return (raw(values) + ...); };
  std::string bytes = "abdomen hip\n" + all(0.f, 0.2f, 0.f, 0.f, 0.1f, 0.f) + "hip \n" +
                      all(0.f, 0.f, 0.f, 0.f, 0.f, 0.f);
  for (const float x : {0.f, 0.02f, 0.04f})
    bytes += all(x, 1.f, 0.f) + all(int16_t{32767}, int16_t{0}, int16_t{0}, int16_t{0}) +
             all(int16_t{23170}, int16_t{0}, int16_t{23170}, int16_t{0});
  return sha256(bytes);
}

std::string git_sum(const std::string& bytes) {
  return sha1("blob " + std::to_string(bytes.size()) + '\0' + bytes);
}

class CmuPack : public FileTest {
 protected:
  /// Publishes files as "@NAME": a folder and the list of what is in it.
  std::string repository(const std::string& name, const std::map<std::string, std::string>& files) {
    nlohmann::json tree = nlohmann::json::array();
    tree.push_back({{"type", "tree"}, {"path", "data"}, {"sha", "0"}});
    for (const auto& [path, bytes] : files) {
      dir.write("web/" + name + "/" + path, bytes);
      tree.push_back(
          {{"type", "blob"}, {"path", path}, {"sha", git_sum(bytes)}, {"size", bytes.size()}});
    }
    return "@" + name + " file://" +
           dir.write("web/" + name + ".json", nlohmann::json({{"tree", tree}}).dump()) +
           " file://" + dir.path() + "/web/" + name + "\n";
  }
  std::string clip(const std::string& sum = toy_sum()) {
    return sum + " 01_01a 01_01.bvh - 2 0 5 0.5 01 test walk\n";
  }
  CmuOriginals list(const std::string& text) {
    return read_cmu_originals(dir.write("list.txt", "# comment\n" + text));
  }
};

TEST_F(CmuPack, TheSumTellsWhichOfTheFilesOfANameIsMeant) {
  const CmuOriginals originals = list(clip());
  dir.write("in/a/01_01.bvh", toy_bvh("45"));
  dir.write("in/a/x01_01.bvh", "not this one");
  EXPECT_EQ(error_of([&] { pack_cmu(originals, dir / "in", dir / "out.h5"); }),
            dir / "in/a/01_01.bvh" + ": does not give clip 01_01a as listed; fetch it again");
  EXPECT_FALSE(fs::exists(dir / "out.h5"));
  dir.write("in/b/01_01.bvh", toy_bvh());
  pack_cmu(originals, dir / "in", dir / "out.h5");
  EXPECT_TRUE(is_packed_cmu(originals, dir / "out.h5"));
  EXPECT_FALSE(is_packed_cmu(list(clip(std::string(64, '0'))), dir / "out.h5"));
  EXPECT_FALSE(is_packed_cmu(originals, dir / "none.h5"));
  const h5::File file = h5::File::open(dir / "out.h5");
  EXPECT_EQ(file.text("/clips/01_01a", "action"), "walk");
  EXPECT_EQ(file.number("/clips/01_01a", "floor_y"), 0.5);
  EXPECT_EQ(file.read<double>("/clips/01_01a/root_translation", {3, 3})[1], 1.0);
}

TEST_F(CmuPack, ShortRecordingsAndMissingOnesAreNamed) {
  fs::create_directories(dir / "in");
  const auto refusal = [&](const std::string& line) {
    return error_of([&] { pack_cmu(list(line), dir / "in", dir / "out.h5"); });
  };
  EXPECT_HAS(refusal(clip()), "holds no 01_01.bvh");
  dir.write("in/01_01.bvh", toy_bvh());
  const std::string sum = toy_sum();
  EXPECT_HAS(refusal(sum + " 01_01a 01_01.bvh - 2 1 5 0.5 01 test walk\n"), "has 5 frames");
  EXPECT_HAS(refusal(sum + " 01_01a 01_01.bvh 01.asf 2 0 5 0.5 01 test walk\n"), "holds no 01.asf");
}

TEST_F(CmuPack, ListsAreHeldToTheirForm) {
  const std::string sum = toy_sum();
  for (const std::string& bad :
       Names{std::string("# nothing\n"), std::string("@a x\n"), std::string("@a x y z\n"),
             "@a x y\n@a x y\n" + clip(), sum + " c f - 2 0 5 0.5 01 test\n",
             sum + " c f - 2 0 5 0.5 01 test walk more\n",
             sum + " c/d f - 2 0 5 0.5 01 test walk\n", sum + " c f - 0 0 5 0.5 01 test walk\n",
             sum + " c f - 2 -1 5 0.5 01 test walk\n", sum + " c f - 2 0 0 0.5 01 test walk\n",
             "abc c f - 2 0 5 0.5 01 test walk\n", clip() + clip()})
    EXPECT_NE(error_of([&] { list(bad); }), "") << bad;
}

TEST_F(CmuPack, FetchingFindsFilesInAnyRepositoryOnce) {
  const std::string text =
      repository("one", {{"100% walks/01#/01_01.bvh", toy_bvh()}, {"README", "-"}}) +
      repository("two", {{"copy/01_01.bvh", toy_bvh()}, {"01_01.bvh", toy_bvh("45")}}) + clip();
  const CmuOriginals originals = list(text);
  fetch_cmu_originals(originals, dir / "got");
  EXPECT_EQ(bytes_of(dir / "got/one/100% walks/01#/01_01.bvh"), toy_bvh());
  EXPECT_EQ(bytes_of(dir / "got/two/01_01.bvh"), toy_bvh("45"));
  EXPECT_FALSE(fs::exists(dir / "got/two/copy")) << "the same bytes again";
  EXPECT_FALSE(fs::exists(dir / "got/one/README"));
  EXPECT_TRUE(has_cmu_originals(originals, dir / "got"));
  EXPECT_FALSE(has_cmu_originals(originals, dir / "web/none"));
  // What is right stays without the network, what is not comes again.
  fs::rename(dir / "web/two", dir / "web/gone");
  dir.write("got/one/100% walks/01#/01_01.bvh", toy_bvh("46"));
  fetch_cmu_originals(originals, dir / "got");
  EXPECT_EQ(bytes_of(dir / "got/one/100% walks/01#/01_01.bvh"), toy_bvh());
}

TEST_F(CmuPack, WhatIsNotAsTheRepositorySaysIsRefused) {
  const auto refusal = [&](const std::string& text) {
    const CmuOriginals originals = list(text + clip());
    return refusal_of<WorkError>([&] { fetch_cmu_originals(originals, dir / "got"); });
  };
  EXPECT_HAS(refusal(repository("empty", {{"README", "-"}})), "none of the listed");
  const std::string changed = repository("changed", {{"01_01.bvh", toy_bvh()}});
  dir.write("web/changed/01_01.bvh", toy_bvh("45"));
  EXPECT_HAS(refusal(changed), "is not the file that its repository lists");
  EXPECT_FALSE(fs::exists(dir / "got/changed/01_01.bvh"));
  const std::string broken = repository("broken", {{"01_01.bvh", toy_bvh()}});
  dir.write("web/broken.json", "{\"tree\": [{\"type\": \"blob\"}");
  EXPECT_HAS(refusal(broken), "is not a repository's list");
  repository("out", {{"01_01.bvh", toy_bvh()}});
  std::string tree = bytes_of(dir / "web/out.json");
  tree.replace(tree.find("01_01.bvh"), 9, "../../01_01.bvh");
  dir.write("web/out.json", tree);
  refusal("@out file://" + dir.path() + "/web/out.json file://" + dir.path() + "/web/out\n");
  EXPECT_FALSE(fs::exists(dir / "01_01.bvh"));
}

TEST_F(CmuPack, TheDataFolderIsFilledFromRepositories) {
  const std::string text = repository("one", {{"01_01.bvh", toy_bvh()}}) + clip();
  list(text);
  dir.write("data.txt", std::string(64, '0') + " 1 cmu/clips30.h5 cmu:list.txt\n");
  const FetchSummary done = fetch_data(dir / "data.txt", dir / "out");
  EXPECT_EQ(done.fetched, 1u);
  EXPECT_TRUE(is_packed_cmu(list(text), dir / "out/cmu/clips30.h5"));
  EXPECT_EQ(fetch_data(dir / "data.txt", dir / "out").present, 1u);
  // From copies: packed already, or the recordings in any folder; or of neither.
  fs::create_directories(dir / "copy/cmu");
  fs::copy(dir / "out/cmu/clips30.h5", dir / "copy/cmu/clips30.h5");
  EXPECT_EQ(fetch_data(dir / "data.txt", dir / "out2", dir / "copy").fetched, 1u);
  EXPECT_EQ(fetch_data(dir / "data.txt", dir / "out3", dir / "web").fetched, 1u);
  EXPECT_EQ(bytes_of(dir / "out3/cmu/clips30.h5"), bytes_of(dir / "out/cmu/clips30.h5"));
  fs::create_directories(dir / "nothing");
  EXPECT_EQ(fetch_data(dir / "data.txt", dir / "out4", dir / "nothing").missing,
            Names{"cmu/clips30.h5"});
}

// ---- the data folder

TEST_F(CmuPack, TheListHoldsEveryPublishedClip) {
  RESTAGE_NEED_DATA();
  const CmuOriginals originals = read_cmu_originals(kList);
  EXPECT_EQ(originals.clips.size(), 247u);
  EXPECT_TRUE(is_packed_cmu(originals, test::data_folder() + "/cmu/clips30.h5"));
}

/// The recordings that the data folder keeps, under the names of their repositories.
size_t gather_recordings(const CmuOriginals& originals, const std::string& folder) {
  const std::map<std::string, std::string> renamed = {{"martial/04.bvh", "135_04.bvh"},
                                                      {"salsa/10.bvh", "60_10.bvh"}};
  std::set<std::string> files;
  for (const CmuOriginal& clip : originals.clips) {
    files.insert(clip.file);
    if (!clip.skeleton.empty()) files.insert(clip.skeleton);
  }
  size_t found = 0;
  for (const std::string& file : files)
    for (const char* kind : {"bvh", "asfamc"}) {
      const auto other = renamed.find(file);
      const std::string source = test::data_folder() + "/cmu/" + kind + "/" +
                                 (other == renamed.end() ? file : other->second) + ".xz";
      if (!fs::exists(source)) continue;
      fs::create_directories(fs::path(folder + "/" + file).parent_path());
      fs::copy(source, folder + "/" + file + ".xz");
      ++found;
    }
  return found;
}

TEST_F(CmuPack, RealRecordingsGiveTheClipsOfTheDataFolderToTheBit) {
  RESTAGE_NEED_DATA();
  CmuOriginals originals = read_cmu_originals(kList);
  EXPECT_EQ(gather_recordings(originals, dir / "in"), 30u);
  std::erase_if(originals.clips, [&](const CmuOriginal& clip) {
    const auto there = [&](const std::string& file) {
      return fs::exists(dir / ("in/" + file + ".xz"));
    };
    return !there(clip.file) || !(clip.skeleton.empty() || there(clip.skeleton));
  });
  EXPECT_EQ(originals.clips.size(), 28u);
  pack_cmu(originals, dir / "in", dir / "clips30.h5");
  const std::vector<CmuClip> published = read_cmu(test::data_folder() + "/cmu/clips30.h5", true);
  for (const CmuClip& clip : read_cmu(dir / "clips30.h5", true)) {
    const auto same = std::find_if(published.begin(), published.end(), [&](const CmuClip& other) {
      return other.motion.id == clip.motion.id;
    });
    ASSERT_NE(same, published.end());
    const Motion &a = clip.motion, &b = same->motion;
    EXPECT_EQ(a.subject + a.split + a.action, b.subject + b.split + b.action);
    ASSERT_EQ(a.frames(), b.frames());
    EXPECT_EQ(a.rest, b.rest);
    EXPECT_EQ(a.hips, b.hips) << a.id;
    EXPECT_EQ(clip.joints, same->joints) << a.id;
    for (size_t f = 0; f < a.frames(); ++f)
      for (size_t j = 0; j < kJoints; ++j)
        ASSERT_EQ(a.global[f][j].coeffs(), b.global[f][j].coeffs()) << a.id << f << " " << j;
  }
}

}  // namespace
}  // namespace restage
