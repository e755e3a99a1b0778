// Scan sequences from files, folders and trees of folders: which frames, which rate, which units.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "datasets/importers/import.h"
#include "datasets/importers/scans.h"
#include "datasets/readers/mesh_io.h"
#include "tests/datasets/npz_support.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

using test::error_of;
using test::npy;
using test::npz;
using test::TempDir;
using test::write_bytes;

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

std::string fact(const ImportReport& report, const std::string& name) {
  for (const auto& [key, value] : report.facts)
    if (key == name) return value;
  return "";
}

/// A person of 80 points, and in front of them any other.
Points person(const Point& first, float unit = 1) {
  Points out{first};
  for (int i = 1; i < 80; ++i) {
    const auto x = static_cast<float>(i);
    out.push_back(unit * Point(0.2f * std::sin(x), 0.02f * x, 0.1f * std::cos(x)));
  }
  return out;
}

std::vector<float> flat(const Points& points) {
  std::vector<float> out;
  for (const Point& p : points) out.insert(out.end(), {p.x(), p.y(), p.z()});
  return out;
}

/// F frames; x of the first point is the frame's number.
std::string numbered(int64_t frames) {
  std::vector<float> values;
  for (int64_t f = 0; f < frames; ++f) {
    const std::vector<float> frame = flat(person({static_cast<float>(f), 1, 2}));
    values.insert(values.end(), frame.begin(), frame.end());
  }
  return npy<float>({frames, 80, 3}, values);
}

/// The numbers of the frames that were taken.
std::vector<int> taken(const std::string& path) {
  const Scans scans = read_scans(path);
  std::vector<int> out;
  for (int64_t f = 0; f < scans.frames(); ++f)
    out.push_back(static_cast<int>(
        scans.points[static_cast<size_t>(scans.frame_offset[static_cast<size_t>(f)])].x()));
  return out;
}

TEST(ImportersScans, TheNearestFrameInTimeIsTakenAndReported) {
  const TempDir dir;
  const auto import = [&](int64_t frames, double fps) {
    write_bytes(dir / "s.npy", numbered(frames));
    ImportOptions options;
    options.motion.fps = fps;
    const ImportSummary summary = import_data(dir / "s.npy", dir / "s.h5", options);
    EXPECT_EQ(summary.sequences, 1u);
    EXPECT_EQ(read_scans(dir / "s.h5").fps, kFps);
    return std::pair(taken(dir / "s.h5"), fact(summary.reports.at(0), "rate"));
  };
  const auto [same, same_text] = import(4, 0);
  EXPECT_EQ(same, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_HAS(same_text, "30 fps (taken for granted: --fps), 4 frames, kept");
  const auto [half, half_text] = import(7, 60);
  EXPECT_EQ(half, (std::vector<int>{0, 2, 4, 6}));
  EXPECT_HAS(half_text, "60 fps (--fps), 7 frames -> 30 fps, 4 frames");
  EXPECT_HAS(half_text, "3 left out, 0 repeated");
  const auto [twice, twice_text] = import(3, 15);
  EXPECT_EQ(twice, (std::vector<int>{0, 0, 1, 1, 2}));
  EXPECT_HAS(twice_text, "0 left out, 2 repeated");
  // 25 -> 30: frame k is nearest to 5 k / 6.
  EXPECT_EQ(import(6, 25).first, (std::vector<int>{0, 1, 2, 2, 3, 4, 5}));
  EXPECT_EQ(import(9, 50).first, (std::vector<int>{0, 2, 3, 5, 7}));
  EXPECT_EQ(import(1, 60).first, std::vector<int>{0});
}

TEST(ImportersScans, UnitsAxesAndTheFilesOwnRate) {
  const TempDir dir;
  write_bytes(dir / "s.npz",
              npz({{"points", npy<float>({1, 80, 3}, flat(person({1000, 2000, 3000}, 1000)))},
                   {"fps", npy<double>({}, {60})}}));
  ImportOptions options;
  options.motion.scale = 0.001;
  options.motion.rest.up = Axis::z;
  options.license = "mine";
  const ImportSummary summary = import_data(dir / "s.npz", dir / "s.h5", options);
  EXPECT_LT((read_scans(dir / "s.h5").points[0] - Point(1, 3, -2)).norm(), 1e-6f);
  EXPECT_EQ(inspect(dir / "s.h5").license, "mine");
  EXPECT_HAS(fact(summary.reports[0], "rate"), "60 fps (the file's)");
  EXPECT_HAS(fact(summary.reports[0], "scale"), "0.001 m a unit (--scale)");
  EXPECT_HAS(fact(summary.reports[0], "up"), "z (--up)");
  options.motion.scale = 1e38;
  EXPECT_HAS(error_of([&] { import_data(dir / "s.npz", dir / "t.h5", options); }), "--scale");
  options.motion.scale = 1;
  options.motion.fps = 1e-9;
  EXPECT_HAS(error_of([&] { import_data(dir / "s.npz", dir / "t.h5", options); }), "--fps");
  EXPECT_FALSE(std::filesystem::exists(dir / "t.h5"));
}

TEST(ImportersScans, TreesOfFolders) {
  const TempDir dir;
  const auto folder = [&](const std::string& name) {
    std::filesystem::create_directories(dir / name);
    return dir / name + "/";
  };
  const auto mesh = [](float x) { return Mesh{person({x, 0, 0}), {{0, 1, 2}}}; };
  // As 4D-DRESS: subject/outfit/take/what/frames, and its pickles.
  for (const char* take : {"Take10", "Take9"}) {
    const std::string scans = folder(std::string("tree/00122/Inner/") + take + "/Scans");
    for (const int f : {11, 12, 100})
      write_ply(scans + "mesh-f" + std::to_string(f) + ".ply", mesh(static_cast<float>(f)));
  }
  write_bytes(folder("tree/00122/Inner/Take9/Meshes_pkl") + "mesh-f00011.pkl", "\x80");
  write_bytes(dir / "tree/00122/Inner/Take9/Meshes_pkl/mesh-f00012.pkl", "\x80");
  // As CAPE: subject/sequence/frames.npz.
  const std::string cape = folder("tree/cape/00032_shortlong_hips");
  for (const int f : {1, 2})
    write_bytes(cape + "hips.00000" + std::to_string(f) + ".npz",
                npz({{"pose", npy<float>({72}, std::vector<float>(72, 0))},
                     {"transl", npy<float>({3}, {0, 0, 0})},
                     {"v_cano", npy<float>({1, 3}, {9, 9, 9})},
                     {"v_posed",
                      npy<float>({80, 3}, flat(person({200.f + static_cast<float>(f), 0, 0})))}}));
  write_bytes(cape + "notes.npz", npz({{"x", npy<double>({1}, {1})}}));
  write_bytes(cape + "broken.npz", "PK");
  // And a sequence in one file.
  write_bytes(folder("tree/more") + "walk.npy", numbered(2));
  folder("tree/empty");
  std::filesystem::create_directory_symlink(dir / "tree", dir / "tree/empty/round_and_round");

  const ImportSummary summary = import_data(dir / "tree", dir / "o.h5");
  EXPECT_EQ(summary.sequences, 4u);
  EXPECT_EQ(summary.frames, 10u);
  EXPECT_EQ(taken(dir / "o.h5"), (std::vector<int>{11, 12, 100, 11, 12, 100, 201, 202, 0, 1}));
  EXPECT_EQ(read_scans(dir / "o.h5").sequence_offset, (std::vector<int64_t>{0, 3, 6, 8, 10}));
  EXPECT_TRUE(verify(dir / "o.h5").empty());
  ASSERT_EQ(summary.reports.size(), 4u);
  EXPECT_HAS(summary.reports[0].file, "Take9/Scans");
  EXPECT_HAS(summary.reports[1].file, "Take10/Scans");
  EXPECT_HAS(summary.reports[3].file, "walk.npy");
  EXPECT_EQ(fact(summary.reports[0], "points"), "80");
  ASSERT_EQ(summary.skipped.size(), 3u);
  EXPECT_HAS(summary.skipped[0], "2 pickles");
  EXPECT_HAS(summary.skipped[1], "broken.npz: is no zip archive");
  EXPECT_HAS(summary.skipped[2], "notes.npz: holds no points");
}

TEST(ImportersScans, ABrokenFrameIsAnErrorAndLeavesNothing) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "in");
  write_ply(dir / "in/1.ply", Mesh{person({0, 0, 0}), {}});
  write_bytes(dir / "in/2.ply", "ply\n");
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "o.h5"); }), "2.ply");
  EXPECT_EQ(test::names_in(dir.path()), std::vector<std::string>{"in"});
  // A single mesh or cloud is a sequence of one frame.
  const ImportSummary one = import_data(dir / "in/1.ply", dir / "o.h5");
  EXPECT_EQ(one.frames, 1u);
  EXPECT_HAS(error_of([&] { import_data(dir / "in/none.npz", dir / "p.h5"); }), "is not there");
}

}  // namespace
}  // namespace restage
