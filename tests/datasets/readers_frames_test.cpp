// Folders of frames: which files are taken, and what becomes of those that cannot be read.
#include <gtest/gtest.h>

#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/frame_folder.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersFrames = FileTest;

std::string all_of(const std::vector<std::string>& remarks) {
  std::string out;
  for (const std::string& remark : remarks) out += remark + "\n";
  return out;
}

std::string one_point(int x) { return "v " + std::to_string(x) + " 0 0\n"; }

std::string ply_point(int x) {
  return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
         "float "
         "z\nend_header\n" +
         std::to_string(x) + " 0 0\n";
}

/// The first coordinate of each frame's first point.
std::vector<float> played(FrameSource& frames) {
  std::vector<float> out;
  while (const auto frame = frames.next()) out.push_back(frame->points.at(0).x());
  return out;
}

TEST_F(ReadersFrames, AFrameIsCountedOnceHoweverManyFilesItHas) {
  for (int f = 0; f < 3; ++f) {
    const std::string stem = "frame_" + std::to_string(f);
    dir.write(stem + ".ply", ply_point(f));
    dir.write(stem + ".obj", one_point(f));
    dir.write(stem + ".xyz", std::to_string(f) + " 0 0\n");
  }
  const auto frames = open_frames(dir.path());
  EXPECT_EQ(played(*frames), (std::vector<float>{0, 1, 2}));
  frames->rewind();
  EXPECT_EQ(frames->next()->source, dir / "frame_0.ply");
  EXPECT_HAS(all_of(frames->remarks()), "left out 3 .obj files");
  EXPECT_HAS(all_of(frames->remarks()), "left out 3 .xyz files");
  // A sequence of two kinds of files is one, where no frame is there twice.
  std::filesystem::remove(dir / "frame_1.ply");
  std::filesystem::remove(dir / "frame_1.xyz");
  EXPECT_EQ(played(*open_frames(dir.path())), (std::vector<float>{0, 1, 2}));
}

TEST_F(ReadersFrames, AFolderAFrame) {
  for (const int f : {0, 1, 2, 10}) {
    dir.write("in/" + std::to_string(f) + "/mesh.ply", ply_point(f));
    dir.write("in/" + std::to_string(f) + "/mesh.obj", one_point(f));
    dir.write("deep/frame" + std::to_string(f) + "/out/model.obj", one_point(f));
    dir.write("sequences/take" + std::to_string(f) + "/a1.obj", one_point(f));
    dir.write("sequences/take" + std::to_string(f) + "/a2.obj", one_point(f));
  }
  dir.write("in/calibration/board.txt", "a board");
  for (const char* name : {"in", "deep"}) {
    const auto frames = open_frames(dir / name);
    EXPECT_EQ(played(*frames), (std::vector<float>{0, 1, 2, 10})) << name;
    EXPECT_HAS(all_of(frames->remarks()), "a folder a frame: 4 folders");
  }
  EXPECT_HAS(error_of([&] { open_frames(dir / "sequences"); }),
             "4 of its folders do; give one sequence");
}

TEST_F(ReadersFrames, AFolderAFrameWithStrays) {
  for (const int f : {0, 1, 2, 3}) {
    const std::string folder = "000" + std::to_string(f) + "/";
    dir.write("empty/" + folder + "note.md", "");
    if (f != 2) dir.write("empty/" + folder + "mesh.ply", ply_point(f));
    dir.write("some/" + folder + "mesh.ply", ply_point(f));
    if (f != 1) dir.write("some/" + folder + "floor.ply", ply_point(70 + f));
    dir.write("all/" + folder + "mesh.ply", ply_point(f));
    dir.write("all/" + folder + "floor.ply", ply_point(70 + f));
    dir.write("beside/" + folder + "f" + std::to_string(f) + ".ply", ply_point(f));
  }
  dir.write("beside/floor.ply", ply_point(77));
  {
    const auto frames = open_frames(dir / "empty");
    EXPECT_EQ(frames->frames(), 4);
    frames->skip(), frames->skip();
    EXPECT_TRUE(frames->next()->points.empty());
    EXPECT_EQ(frames->next()->points[0].x(), 3);
    EXPECT_HAS(all_of(frames->remarks()), "1 folder holds no 'mesh.ply': a frame without points");
  }
  const auto some = open_frames(dir / "some");
  EXPECT_EQ(played(*some), (std::vector<float>{0, 1, 2, 3}));
  EXPECT_HAS(all_of(some->remarks()), "'mesh.ply' is taken of each, and left out are 'floor.ply'");
  const std::string said = error_of([&] { open_frames(dir / "all"); });
  EXPECT_HAS(said, "in each several files that may be the frame");
  EXPECT_HAS(said, "'floor.ply' and 'mesh.ply'");
  EXPECT_HAS(said, "leave one of them in each folder");
  const auto beside = open_frames(dir / "beside");
  EXPECT_EQ(played(*beside), (std::vector<float>{0, 1, 2, 3}));
  EXPECT_HAS(all_of(beside->remarks()), "left out 'floor.ply': beside the folders");
}

TEST_F(ReadersFrames, SeveralCamerasOfOneMomentAreNoFrames) {
  for (const char* folder : {"8/", "9/", "10/"}) {
    for (const char* camera : {"cam0", "cam1"}) {
      dir.write(cat("files/", folder, camera, ".ply"), ply_point(1));
      dir.write(cat("folders/", folder, camera, "/cloud.ply"), ply_point(1));
    }
    for (const char* camera : {"left", "right"})
      dir.write(cat("sides/", folder, camera, ".ply"), ply_point(1));
    for (const char* name : {"0", "1"})
      dir.write(cat("numbers/", folder, name, ".ply"), ply_point(1));
  }
  for (const char* name : {"files", "folders", "sides"}) {
    const std::string said = error_of([&] { open_frames(dir / name); });
    EXPECT_HAS(said, "in each the clouds of several cameras") << name;
    EXPECT_HAS(said, "fuse the clouds of all cameras");
  }
  for (const char* name : {"files/8", "folders/8", "sides/8"})
    EXPECT_HAS(error_of([&] { open_frames(dir / name); }), "several cameras") << name;
  EXPECT_HAS(error_of([&] { open_frames(dir / "numbers"); }), "seen by several cameras");
}

TEST_F(ReadersFrames, AnotherNameInTheFramesPlaceIsSaid) {
  for (const int f : {0, 1, 2, 3}) {
    const std::string folder = "000" + std::to_string(f) + "/";
    dir.write("other/" + folder + (f == 2 ? "body.ply" : "mesh.ply"), ply_point(f));
  }
  const std::string said = error_of([&] { open_frames(dir / "other"); });
  EXPECT_HAS(said, "0002: holds 'body.ply' where the other folders have 'mesh.ply'");
}

TEST_F(ReadersFrames, NamesThatDifferInCapitalsAloneAreRefused) {
  for (const char* name : {"f1.ply", "f1.PLY", "f2.ply"}) dir.write(name, ply_point(1));
  EXPECT_HAS(error_of([&] { open_frames(dir.path()); }), "'f1.PLY' and 'f1.ply' differ in capital");
}

TEST_F(ReadersFrames, AFrameThatCannotBeReadShowsNothing) {
  for (const int f : {0, 1, 2, 3, 4, 5}) dir.write(std::to_string(f) + ".ply", ply_point(f));
  dir.write("1.ply", ply_point(1).substr(0, ply_point(1).size() - 6));
  dir.write("3.ply", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 7\n");
  const auto all = open_frames(dir.path());
  for (int f = 0; f < 6; ++f) {
    const auto frame = all->next();
    EXPECT_EQ(frame->points.empty(), f == 1 || f == 3) << f;
    EXPECT_EQ(frame->fault.has_value(), f == 1 || f == 3) << f;
    EXPECT_EQ(frame->number, f);
    if (frame->fault) {
      EXPECT_HAS(frame->fault->what(), std::to_string(f) + ".ply: ");
    }
  }
  const auto seen = without_empty_frames(open_frames(dir.path()));
  EXPECT_EQ(played(*seen), (std::vector<float>{0, 2, 4, 5}));
  EXPECT_HAS(all_of(seen->remarks()),
             "2 frames could not be read and count as frames without points");
  EXPECT_HAS(all_of(seen->remarks()), "1.ply: is cut short");
  EXPECT_HAS(all_of(seen->remarks()), "3.ply: is a Git LFS pointer");
  // Where none can be read, the first one's reason is the answer.
  for (const int f : {0, 1, 2, 3, 4, 5}) dir.write(std::to_string(f) + ".ply", "ply of a kind");
  const auto none = without_empty_frames(open_frames(dir.path()));
  EXPECT_HAS(error_of([&] { none->next(); }), "0.ply: ");
}

TEST_F(ReadersFrames, PointersOfGitLfsAreNamed) {
  for (const int f : {0, 1, 2, 3})
    dir.write("in/" + std::to_string(f) + ".ply",
              f == 3 ? ply_point(3) : "version https://git-lfs.github.com/spec/v1\noid sha256:0\n");
  const std::string said = error_of([&] { open_frames(dir / "in"); });
  EXPECT_HAS(said, "3 of 4 frames are Git LFS pointers");
  EXPECT_HAS(said, "; run git lfs pull");
  EXPECT_HAS(error_of([&] { open_frames(dir / "in/0.ply"); }), "Git LFS pointer");
}

TEST_F(ReadersFrames, TextsAreFramesOnlyIfTheyArePoints) {
  dir.write("in/1.txt", "# x y z\n1 0 0\n");
  dir.write("in/2.txt", "2 0 0\n");
  dir.write("in/readme.txt", "two frames of a walk\n");
  EXPECT_EQ(played(*open_frames(dir / "in")), (std::vector<float>{1, 2}));
  dir.write("in/1.ply", ply_point(7));
  EXPECT_EQ(played(*open_frames(dir / "in")), (std::vector<float>{7}))
      << "poses or times beside frames";
  dir.write("none/readme.txt", "nothing\n");
  EXPECT_HAS(error_of([&] { open_frames(dir / "none"); }), "holds no PLY, OBJ or glTF files");
}

}  // namespace
}  // namespace restage
