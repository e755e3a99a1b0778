// `restage data import` as a function: data folders, BVH files and folders, and scan sequences from
// files, folders and trees of folders (which frames, which rate, which units), into schema files.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "datasets/importers/import.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/scans.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/schema.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/data_folder.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using ImportersScans = FileTest;

class ImportersImport : public FileTest {
 protected:
  std::string out() const { return dir / "out.h5"; }
};

TEST_F(ImportersImport, DataFolderBecomesOneFile) {
  RESTAGE_NEED_DATA();
  // Two bodies and all clips: the whole set takes seconds more and shows nothing more.
  std::string few, line;
  std::ifstream csv(data_folder() + "/body/bodies.csv");
  for (int i = 0; i < 3 && std::getline(csv, line); ++i) few += line + "\n";
  dir.write("in/body/bodies.csv", few);
  fs::create_symlink(fs::absolute(data_folder() + "/cmu"), dir / "in/cmu");
  fs::create_symlink(fs::absolute(data_folder() + "/body/makehuman.h5"),
                     dir / "in/body/makehuman.h5");
  const ImportSummary summary = import_data(dir / "in", out());
  EXPECT_EQ(summary.bodies, 2u);
  EXPECT_EQ(summary.motions, 247u);
  EXPECT_TRUE(summary.skipped.empty());
  EXPECT_TRUE(verify(out()).empty());
  const std::vector<Body> bodies = read_bodies(out());
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].id, "b000");
  EXPECT_EQ(bodies[0].rest.vertices.size(), 13380u);
  EXPECT_EQ(bodies[1].rest.faces.size(), 26756u);
  const std::vector<Motion> test = read_motions(out(), "test");
  EXPECT_EQ(test.size(), 50u);
  for (const Motion& motion : test) EXPECT_FALSE(motion.action.empty());
  const Inspection inspection = inspect(out());
  EXPECT_HAS(inspection.license, "CC0");
  EXPECT_HAS(inspection.provenance, "mocap.cs.cmu.edu");
}

TEST_F(ImportersImport, FolderOfBvhFilesSkipsBadOnes) {
  dir.write("in/02_walk.bvh", bvh_test::text({}));
  dir.write("in/01_walk.BVH", bvh_test::text({}));
  dir.write("in/03_bad.bvh", "HIERARCHY\n");
  dir.write("in/readme.txt", "no motion\n");
  ImportOptions options;
  options.license = "CC0-1.0";
  options.motion.split = "test";
  const ImportSummary summary = import_data(dir / "in", out(), options);
  EXPECT_EQ(summary.motions, 2u);
  ASSERT_EQ(summary.skipped.size(), 1u);
  EXPECT_HAS(summary.skipped[0], "03_bad.bvh:1");
  const std::vector<Motion> motions = read_motions(out(), "test");
  ASSERT_EQ(motions.size(), 2u);
  EXPECT_EQ(motions[0].id, "01_walk");
  EXPECT_EQ(motions[0].subject, "01");
  EXPECT_EQ(inspect(out()).license, "CC0-1.0");
}

TEST_F(ImportersImport, OfAFileAllGoesInOrNothing) {
  const Body body = testing::tiny_body("b", "train");
  const Motion motion = testing::tiny_motion("m", "ann", "train", 1);
  ImportSummary summary;
  ImportWriter writer(out(), {}, summary);
  writer.add("first.glb", {}, {motion});
  EXPECT_THROW(writer.add("twins.glb", {body, body}, {}), InputError);
  EXPECT_EQ(error_of([&] { writer.add("second.glb", {body}, {motion}); }),
            "second.glb: its motion 'm' has the name of one in first.glb; rename one of the two");
  writer.commit();
  EXPECT_EQ(summary.bodies, 0u);
  EXPECT_EQ(summary.motions, 1u);
  EXPECT_EQ(inspect(out()).kind, "motions");
}

TEST_F(ImportersImport, OptionsAreJudgedBeforeFiles) {
  ImportOptions options;
  options.motion.split = "nope";
  EXPECT_HAS(error_of([&] { import_data("no such file", out(), options); }), "split 'nope'");
}

TEST_F(ImportersImport, NothingIsLeftBehindByAFailure) {
  dir.write("in/bad.bvh", "no BVH");
  for (const char* source : {"in/bad.bvh", "in", "nothing"})
    EXPECT_THROW(import_data(dir / source, out()), InputError) << source;
  fs::remove(dir / "in/bad.bvh");
  EXPECT_THROW(import_data(dir / "in", out()), InputError) << "an empty folder";
  EXPECT_EQ(names_in(dir.path()), Names{"in"});
}

// ---- scans
// ---------------------------------------------------------------------------------------

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

TEST_F(ImportersScans, TheNearestFrameInTimeIsTakenAndReported) {
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
  EXPECT_HAS(same_text, "30 fps (taken for granted: fps), 4 frames, kept");
  const auto [half, half_text] = import(7, 60);
  EXPECT_EQ(half, (std::vector<int>{0, 2, 4, 6}));
  EXPECT_HAS(half_text, "60 fps (fps), 7 frames -> 30 fps, 4 frames");
  EXPECT_HAS(half_text, "3 left out, 0 repeated");
  const auto [twice, twice_text] = import(3, 15);
  EXPECT_EQ(twice, (std::vector<int>{0, 0, 1, 1, 2}));
  EXPECT_HAS(twice_text, "0 left out, 2 repeated");
  // 25 -> 30: frame k is nearest to 5 k / 6.
  EXPECT_EQ(import(6, 25).first, (std::vector<int>{0, 1, 2, 2, 3, 4, 5}));
  EXPECT_EQ(import(9, 50).first, (std::vector<int>{0, 2, 3, 5, 7}));
  EXPECT_EQ(import(1, 60).first, std::vector<int>{0});
}

TEST_F(ImportersScans, UnitsAxesAndTheFilesOwnRate) {
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
  EXPECT_HAS(fact(summary.reports[0], "scale"), "0.001 m a unit (scale)");
  EXPECT_HAS(fact(summary.reports[0], "up"), "z (up)");
  options.motion.scale = 1e38;
  EXPECT_HAS(error_of([&] { import_data(dir / "s.npz", dir / "t.h5", options); }), "scale");
  options.motion.scale = 1;
  options.motion.fps = 1e-9;
  EXPECT_HAS(error_of([&] { import_data(dir / "s.npz", dir / "t.h5", options); }), "fps");
  EXPECT_FALSE(fs::exists(dir / "t.h5"));
}

TEST_F(ImportersScans, TreesOfFolders) {
  const auto mesh = [](float x) { return Mesh{person({x, 0, 0}), {{0, 1, 2}}}; };
  // As 4D-DRESS: subject/outfit/take/what/frames, and its pickles.
  for (const std::string take : {"Take10", "Take9"}) {
    const std::string scans = dir / "tree/00122/Inner/" + take + "/Scans";
    fs::create_directories(scans);
    for (const int f : {11, 12, 100})
      write_ply(scans + "/mesh-f" + std::to_string(f) + ".ply", mesh(static_cast<float>(f)));
  }
  dir.write("tree/00122/Inner/Take9/Meshes_pkl/mesh-f00011.pkl", "\x80");
  dir.write("tree/00122/Inner/Take9/Meshes_pkl/mesh-f00012.pkl", "\x80");
  // As CAPE: subject/sequence/frames.npz.
  const std::string cape = "tree/cape/00032_shortlong_hips/";
  for (const int f : {1, 2})
    dir.write(cape + "hips.00000" + std::to_string(f) + ".npz",
              npz({{"pose", npy<float>({72}, std::vector<float>(72, 0))},
                   {"transl", npy<float>({3}, {0, 0, 0})},
                   {"v_cano", npy<float>({1, 3}, {9, 9, 9})},
                   {"v_posed",
                    npy<float>({80, 3}, flat(person({200.f + static_cast<float>(f), 0, 0})))}}));
  dir.write(cape + "notes.npz", npz({{"x", npy<double>({1}, {1})}}));
  dir.write(cape + "broken.npz", "PK");
  // And a sequence in one file, beside a folder that leads back.
  dir.write("tree/more/walk.npy", numbered(2));
  fs::create_directories(dir / "tree/empty");
  fs::create_directory_symlink(dir / "tree", dir / "tree/empty/round_and_round");

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

TEST_F(ImportersScans, ABrokenFrameIsHeldAndOnlyBrokenOnesLeaveNothing) {
  fs::create_directories(dir / "in");
  for (const int f : {1, 2}) write_bytes(dir / "in/" + std::to_string(f) + ".ply", "ply\n");
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "o.h5"); }), "1.ply: is cut short");
  EXPECT_EQ(names_in(dir.path()), Names{"in"});
  write_ply(dir / "in/1.ply", Mesh{person({0, 0, 0}), {}});
  const ImportSummary held = import_data(dir / "in", dir / "o.h5");
  EXPECT_EQ(held.frames, 2u);
  EXPECT_HAS(held.reports[0].remarks.at(0), "1 frame could not be read");
  EXPECT_HAS(held.reports[0].remarks.at(0), "2.ply: is cut short");
  // A single mesh or cloud is a sequence of one frame.
  const ImportSummary one = import_data(dir / "in/1.ply", dir / "o.h5");
  EXPECT_EQ(one.frames, 1u);
  EXPECT_HAS(error_of([&] { import_data(dir / "in/none.npz", dir / "p.h5"); }), "is not there");
}

TEST_F(ImportersScans, FramesThatShowNobodyAreReplacedUpToASecond) {
  const auto at = [&](int f) { return dir / ("in/f" + std::to_string(f) + ".ply"); };
  fs::create_directories(dir / "in");
  for (int f = 0; f < 6; ++f) write_ply(at(f), Mesh{person({static_cast<float>(f), 0, 0}), {}});
  write_bytes(at(2),
              "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
              "property float z\nend_header\n");
  write_ply(at(3), Mesh{{{0, 0, 0}, {1, 1, 1}}, {}});
  const ImportSummary done = import_data(dir / "in", dir / "o.h5");
  EXPECT_EQ(done.frames, 6u);
  EXPECT_HAS(done.reports[0].remarks.at(0), "2 frames show too little");
  const Scans scans = read_scans(dir / "o.h5");
  std::vector<float> x;
  for (size_t f = 0; f < 6; ++f)
    x.push_back(scans.points[static_cast<size_t>(scans.frame_offset[f])].x());
  const float first = x[0];
  for (float& value : x) value -= first;
  EXPECT_EQ(x, (std::vector<float>{0, 1, 1, 4, 4, 5}));
  // At the beginning and at the end the nearest is the only one there is; nobody at all is an
  // error.
  for (const int f : {0, 5}) write_ply(at(f), Mesh{{{0, 0, 0}}, {}});
  EXPECT_EQ(import_data(dir / "in", dir / "o.h5").frames, 6u);
  for (const int f : {1, 4}) write_ply(at(f), Mesh{{{0, 0, 0}}, {}});
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "p.h5"); }), "shows nobody");
  for (int f = 0; f < 40; ++f) {
    const bool seen = f == 0 || f == 39;
    write_ply(at(f), Mesh{seen ? person({0, 0, 0}) : Points{{0, 0, 0}}, {}});
  }
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "p.h5"); }), "nobody for 38 frames");
}

TEST_F(ImportersScans, NonFinitePointsStraysAndTwinsAreSaid) {
  fs::create_directories(dir / "in");
  for (int f = 0; f < 3; ++f) {
    const std::string stem = dir / ("in/frame_" + std::to_string(f));
    Mesh mesh{person({0, 0, 0}), {}};
    write_obj(stem + ".obj", mesh);
    mesh.vertices.push_back(Point::Constant(std::numeric_limits<float>::quiet_NaN()));
    write_ply(stem + ".ply", mesh);
  }
  write_ply(dir / "in/floor.ply", Mesh{person({0, 0, 0}), {}});
  const ImportSummary done = import_data(dir / "in", dir / "o.h5");
  EXPECT_EQ(done.frames, 3u);
  std::string said;
  for (const std::string& remark : done.reports.at(0).remarks) said += remark + "\n";
  for (const char* words :
       {"left out 3 .obj files", "left out 'floor.ply'", "left out 3 points whose"})
    EXPECT_HAS(said, words);
  EXPECT_EQ(verify(dir / "o.h5"), Names{});
}

/// A point that walks about for so many frames, as roots, centres of mass and joints do.
std::vector<float> walk(int64_t frames, double unit = 1) {
  std::vector<float> out;
  for (int64_t f = 0; f < frames; ++f) {
    const double t = 0.05 * static_cast<double>(f);
    for (const double x : {std::sin(t), 0.9 + 0.03 * std::sin(6 * t), 0.5 * t})
      out.push_back(static_cast<float>(unit * x));
  }
  return out;
}

TEST_F(ImportersScans, PathsOfOnePointAreNoScans) {
  for (const char* name : {"", "positions", "points", "where", "root_pos", "com"}) {
    const std::string array = npy<float>({200, 3}, walk(200));
    const std::string file =
        *name == 0 ? dir.write("a.npy", array) : dir.write("a.npz", npz({{name, array}}));
    const std::string said = error_of([&] { import_data(file, dir / "o.h5"); });
    EXPECT_TRUE(said.find("places of one moving point") != std::string::npos ||
                said.find("holds no points") != std::string::npos)
        << said;
  }
  {
    h5::File file = h5::File::create(dir / "a.h5");
    file.write<float>("/track", {200, 3}, walk(200));
    file.commit();
  }
  EXPECT_HAS(error_of([&] { import_data(dir / "a.h5", dir / "o.h5"); }), "one moving point");
  EXPECT_FALSE(fs::exists(dir / "o.h5"));
  ImportOptions forced;
  forced.motion.force = true;
  EXPECT_EQ(import_data(dir / "a.h5", dir / "o.h5", forced).frames, 1u);
}

TEST_F(ImportersScans, AnotherUnitThanMetresIsNotTakenForMetres) {
  const std::pair<float, const char*> units[] = {{100, "give scale 0.01,"},
                                                 {1000, "give scale 0.001,"}};
  for (const auto& [unit, says] : units) {
    const Points points = person({0, 0, 0}, unit);
    const std::string file = dir.write("a.npy", npy<float>({80, 3}, flat(points)));
    EXPECT_HAS(error_of([&] { import_data(file, dir / "o.h5"); }), says);
    ImportOptions options;
    options.motion.scale = 1 / unit;
    EXPECT_EQ(import_data(file, dir / "o.h5", options).frames, 1u);
  }
  const std::string tiny = dir.write("b.npy", npy<float>({80, 3}, flat(person({0, 0, 0}, 1e-4f))));
  EXPECT_HAS(error_of([&] { import_data(tiny, dir / "p.h5"); }), "no person is in any unit");
}

TEST_F(ImportersScans, FoldersOfFramesAndHdf5FilesOfOthers) {
  for (int f = 0; f < 3; ++f) {
    const std::string folder = dir / ("tree/walk/" + std::to_string(f));
    fs::create_directories(folder);
    write_ply(folder + "/mesh.ply", Mesh{person({0, 0, 0}), {}});
    fs::create_directories(dir / "tree/run");
    write_ply(dir / ("tree/run/" + std::to_string(f) + ".ply"), Mesh{person({0, 0, 0}), {}});
  }
  {
    const Points points = person({0, 0, 0});
    std::vector<float> values;  // [V, 3, 2]
    for (const Point& p : points)
      for (int c = 0; c < 3; ++c) values.insert(values.end(), 2, p[c]);
    h5::File file = h5::File::create(dir / "tree/dfaust.hdf5");
    file.write<float>("/50002_hips", {std::ssize(points), 3, 2}, values);
    file.write<float>("/50002_knees", {std::ssize(points), 3, 2}, values);
    file.commit();
  }
  const ImportSummary done = import_data(dir / "tree", dir / "o.h5");
  EXPECT_EQ(done.sequences, 4u);
  EXPECT_EQ(done.frames, 10u);
  EXPECT_EQ(import_data(dir / "tree/dfaust.hdf5", dir / "p.h5").sequences, 2u);
  EXPECT_EQ(import_data(dir / "tree/walk", dir / "p.h5").frames, 3u);
  EXPECT_HAS(error_of([&] { import_data(dir.write("a.fbx", "Kaydara"), dir / "p.h5"); }),
             "is no FBX file; export it again, or export GLB (glTF) from Blender");
}

}  // namespace
}  // namespace restage
