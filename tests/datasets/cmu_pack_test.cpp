// CMU's recordings, found, fetched and packed into the file that read_cmu() reads.
#include "datasets/importers/cmu_pack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "autograd/base/error.h"
#include "datasets/fetch/fetch.h"
#include "datasets/fetch/fetch_cmu.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/cmu.h"
#include "datasets/readers/sha256.h"
#include "tests/datasets/npz_support.h"
#include "tests/datasets/schema_support.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::error_of;
using test::TempDir;
using test::write_bytes;

const char* const kList = RESTAGE_SOURCE_DIR "/configs/data/cmu_originals.txt";

// ---- two joints, five frames
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
  const auto raw = [](auto... values) { return (test::raw(values) + ...); };
  std::string bytes = "abdomen hip\n" + raw(0.f, 0.2f, 0.f, 0.f, 0.1f, 0.f) + "hip \n" +
                      raw(0.f, 0.f, 0.f, 0.f, 0.f, 0.f);
  for (const float x : {0.f, 0.02f, 0.04f})
    bytes += raw(x, 1.f, 0.f) + raw(int16_t{32767}, int16_t{0}, int16_t{0}, int16_t{0}) +
             raw(int16_t{23170}, int16_t{0}, int16_t{23170}, int16_t{0});
  return sha256(bytes);
}

std::string git_sum(const std::string& bytes) {
  return sha1("blob " + std::to_string(bytes.size()) + '\0' + bytes);
}

class CmuPack : public ::testing::Test {
 protected:
  /// Publishes files as "@NAME": a folder and the list of what is in it.
  std::string repository(const std::string& name, const std::map<std::string, std::string>& files) {
    nlohmann::json tree = nlohmann::json::array();
    tree.push_back({{"type", "tree"}, {"path", "data"}, {"sha", "0"}});
    for (const auto& [path, bytes] : files) {
      const std::string target = dir_ / ("web/" + name + "/" + path);
      fs::create_directories(fs::path(target).parent_path());
      write_bytes(target, bytes);
      tree.push_back(
          {{"type", "blob"}, {"path", path}, {"sha", git_sum(bytes)}, {"size", bytes.size()}});
    }
    write_bytes(dir_ / ("web/" + name + ".json"), nlohmann::json({{"tree", tree}}).dump());
    return "@" + name + " file://" + dir_.path() + "/web/" + name + ".json file://" + dir_.path() +
           "/web/" + name + "\n";
  }
  std::string clip(const std::string& sum = toy_sum()) {
    return sum + " 01_01a 01_01.bvh - 2 0 5 0.5 01 test walk\n";
  }
  CmuOriginals list(const std::string& text) {
    write_bytes(dir_ / "list.txt", "# comment\n" + text);
    return read_cmu_originals(dir_ / "list.txt");
  }
  TempDir dir_;
};

TEST_F(CmuPack, TheSumTellsWhichOfTheFilesOfANameIsMeant) {
  const CmuOriginals originals = list(clip());
  fs::create_directories(dir_ / "in/a");
  fs::create_directories(dir_ / "in/b");
  write_bytes(dir_ / "in/a/01_01.bvh", toy_bvh("45"));
  write_bytes(dir_ / "in/a/x01_01.bvh", "not this one");
  EXPECT_EQ(error_of([&] { pack_cmu(originals, dir_ / "in", dir_ / "out.h5"); }),
            dir_ / "in/a/01_01.bvh" + ": does not give clip 01_01a as listed; fetch it again");
  EXPECT_FALSE(fs::exists(dir_ / "out.h5"));
  write_bytes(dir_ / "in/b/01_01.bvh", toy_bvh());
  pack_cmu(originals, dir_ / "in", dir_ / "out.h5");
  EXPECT_TRUE(is_packed_cmu(originals, dir_ / "out.h5"));
  EXPECT_FALSE(is_packed_cmu(list(clip(std::string(64, '0'))), dir_ / "out.h5"));
  EXPECT_FALSE(is_packed_cmu(originals, dir_ / "none.h5"));
  const h5::File file = h5::File::open(dir_ / "out.h5");
  EXPECT_EQ(file.text("/clips/01_01a", "action"), "walk");
  EXPECT_EQ(file.number("/clips/01_01a", "floor_y"), 0.5);
  EXPECT_EQ(file.read<double>("/clips/01_01a/root_translation", {3, 3})[1], 1.0);
}

TEST_F(CmuPack, ShortRecordingsAndMissingOnesAreNamed) {
  fs::create_directories(dir_ / "in");
  const auto refusal = [&](const std::string& line) {
    return error_of([&] { pack_cmu(list(line), dir_ / "in", dir_ / "out.h5"); });
  };
  EXPECT_NE(refusal(clip()).find("holds no 01_01.bvh"), std::string::npos);
  write_bytes(dir_ / "in/01_01.bvh", toy_bvh());
  const std::string sum = toy_sum();
  EXPECT_NE(refusal(sum + " 01_01a 01_01.bvh - 2 1 5 0.5 01 test walk\n").find("has 5 frames"),
            std::string::npos);
  EXPECT_NE(
      refusal(sum + " 01_01a 01_01.bvh 01.asf 2 0 5 0.5 01 test walk\n").find("holds no 01.asf"),
      std::string::npos);
}

TEST_F(CmuPack, ListsAreHeldToTheirForm) {
  const std::string sum = toy_sum();
  for (const std::string& bad : std::vector<std::string>{
           std::string("# nothing\n"), std::string("@a x\n"), std::string("@a x y z\n"),
           "@a x y\n@a x y\n" + clip(), sum + " c f - 2 0 5 0.5 01 test\n",
           sum + " c f - 2 0 5 0.5 01 test walk more\n", sum + " c/d f - 2 0 5 0.5 01 test walk\n",
           sum + " c f - 0 0 5 0.5 01 test walk\n", sum + " c f - 2 -1 5 0.5 01 test walk\n",
           sum + " c f - 2 0 0 0.5 01 test walk\n", "abc c f - 2 0 5 0.5 01 test walk\n",
           clip() + clip()})
    EXPECT_NE(error_of([&] { list(bad); }), "") << bad;
}

TEST_F(CmuPack, FetchingFindsFilesInAnyRepositoryOnce) {
  const std::string text =
      repository("one", {{"100% walks/01#/01_01.bvh", toy_bvh()}, {"README", "-"}}) +
      repository("two", {{"copy/01_01.bvh", toy_bvh()}, {"01_01.bvh", toy_bvh("45")}}) + clip();
  const CmuOriginals originals = list(text);
  fetch_cmu_originals(originals, dir_ / "got");
  EXPECT_EQ(bytes_of(dir_ / "got/one/100% walks/01#/01_01.bvh"), toy_bvh());
  EXPECT_EQ(bytes_of(dir_ / "got/two/01_01.bvh"), toy_bvh("45"));
  EXPECT_FALSE(fs::exists(dir_ / "got/two/copy")) << "the same bytes again";
  EXPECT_FALSE(fs::exists(dir_ / "got/one/README"));
  EXPECT_TRUE(has_cmu_originals(originals, dir_ / "got"));
  EXPECT_FALSE(has_cmu_originals(originals, dir_ / "web/none"));
  // What is right stays without the network, what is not comes again.
  fs::rename(dir_ / "web/two", dir_ / "web/gone");
  write_bytes(dir_ / "got/one/100% walks/01#/01_01.bvh", toy_bvh("46"));
  fetch_cmu_originals(originals, dir_ / "got");
  EXPECT_EQ(bytes_of(dir_ / "got/one/100% walks/01#/01_01.bvh"), toy_bvh());
}

TEST_F(CmuPack, WhatIsNotAsTheRepositorySaysIsRefused) {
  const auto refusal = [&](const std::string& text) {
    const CmuOriginals originals = list(text + clip());
    try {
      fetch_cmu_originals(originals, dir_ / "got");
    } catch (const WorkError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(repository("empty", {{"README", "-"}})).find("none of the listed"),
            std::string::npos);
  const std::string changed = repository("changed", {{"01_01.bvh", toy_bvh()}});
  write_bytes(dir_ / "web/changed/01_01.bvh", toy_bvh("45"));
  EXPECT_NE(refusal(changed).find("is not the file that its repository lists"), std::string::npos);
  EXPECT_FALSE(fs::exists(dir_ / "got/changed/01_01.bvh"));
  const std::string broken = repository("broken", {{"01_01.bvh", toy_bvh()}});
  write_bytes(dir_ / "web/broken.json", "{\"tree\": [{\"type\": \"blob\"}");
  EXPECT_NE(refusal(broken).find("is not a repository's list"), std::string::npos);
  repository("out", {{"01_01.bvh", toy_bvh()}});
  std::string tree = bytes_of(dir_ / "web/out.json");
  tree.replace(tree.find("01_01.bvh"), 9, "../../01_01.bvh");
  write_bytes(dir_ / "web/out.json", tree);
  refusal("@out file://" + dir_.path() + "/web/out.json file://" + dir_.path() + "/web/out\n");
  EXPECT_FALSE(fs::exists(dir_ / "01_01.bvh"));
}

TEST_F(CmuPack, TheDataFolderIsFilledFromRepositories) {
  const std::string text = repository("one", {{"01_01.bvh", toy_bvh()}}) + clip();
  list(text);
  write_bytes(dir_ / "data.txt", std::string(64, '0') + " 1 cmu/clips30.h5 cmu:list.txt\n");
  const FetchSummary done = fetch_data(dir_ / "data.txt", dir_ / "out");
  EXPECT_EQ(done.fetched, 1u);
  EXPECT_TRUE(is_packed_cmu(list(text), dir_ / "out/cmu/clips30.h5"));
  EXPECT_EQ(fetch_data(dir_ / "data.txt", dir_ / "out").present, 1u);
  // From copies: packed already, or the recordings in any folder; or of neither.
  fs::create_directories(dir_ / "copy/cmu");
  fs::copy(dir_ / "out/cmu/clips30.h5", dir_ / "copy/cmu/clips30.h5");
  EXPECT_EQ(fetch_data(dir_ / "data.txt", dir_ / "out2", dir_ / "copy").fetched, 1u);
  EXPECT_EQ(fetch_data(dir_ / "data.txt", dir_ / "out3", dir_ / "web").fetched, 1u);
  EXPECT_EQ(bytes_of(dir_ / "out3/cmu/clips30.h5"), bytes_of(dir_ / "out/cmu/clips30.h5"));
  fs::create_directories(dir_ / "nothing");
  EXPECT_EQ(fetch_data(dir_ / "data.txt", dir_ / "out4", dir_ / "nothing").missing,
            std::vector<std::string>{"cmu/clips30.h5"});
}

// ---- the data folder
// ---------------------------------------------------------------------------

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
  EXPECT_EQ(gather_recordings(originals, dir_ / "in"), 30u);
  std::erase_if(originals.clips, [&](const CmuOriginal& clip) {
    const auto there = [&](const std::string& file) {
      return fs::exists(dir_ / ("in/" + file + ".xz"));
    };
    return !there(clip.file) || !(clip.skeleton.empty() || there(clip.skeleton));
  });
  EXPECT_EQ(originals.clips.size(), 28u);
  pack_cmu(originals, dir_ / "in", dir_ / "clips30.h5");
  const std::vector<CmuClip> published = read_cmu(test::data_folder() + "/cmu/clips30.h5", true);
  for (const CmuClip& clip : read_cmu(dir_ / "clips30.h5", true)) {
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
