// Which files of a folder are the frames of a sequence, and in which order.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/frame_names.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersFrames = FileTest;

/// The order of these names, whatever order they come in.
Names ordered(Names names, FrameList* list = nullptr) {
  std::sort(names.begin(), names.end());
  const FrameList out = order_frames(names, "in");
  if (list != nullptr) *list = out;
  return out.files;
}

std::string all_of(const std::vector<std::string>& remarks) {
  std::string out;
  for (const std::string& remark : remarks) out += remark + "\n";
  return out;
}

TEST(FrameNames, NumbersAreComparedAsTheyAreMeant) {
  const Names series[] = {
      {"f1.ply", "f2.ply", "f10.ply"},
      // Times: decimals of unequal length, with and without a fraction.
      {"100.0.ply", "100.05.ply", "100.1.ply", "100.15.ply", "100.2.ply"},
      {"9.5.ply", "10.ply", "10.25.ply", "10.5.ply"},
      {"t_0.2.ply", "t_0.25.ply", "t_0.3.ply", "t_0.35.ply"},
      {"1700000000.9.ply", "1700000001.05.ply", "1700000001.2.ply"},
      // Counters behind a point.
      {"take1.8.ply", "take1.9.ply", "take1.10.ply", "take1.11.ply"},
      {"walk.v2.0009.ply", "walk.v2.0010.ply", "walk.v2.0011.ply"},
      {"2024.1.9.ply", "2024.1.10.ply", "2024.1.11.ply"},
      // Negative numbers, where a minus is a sign.
      {"-10.ply", "-2.ply", "0.ply", "3.ply"},
      {"-0.5.ply", "-0.25.ply", "0.0.ply", "0.25.ply"},
      {"frame_-2.ply", "frame_-1.ply", "frame_0.ply", "frame_1.ply"},
      {"frame-2.ply", "frame-1.ply", "frame0.ply", "frame1.ply"},
      {"t=-0.2.ply", "t=-0.1.ply", "t=0.0.ply", "t=0.1.ply"},
      // Where it is a mark.
      {"frame-1.ply", "frame-2.ply", "frame-10.ply"},
      {"2024-01-02_10-20-30.ply", "2024-01-02_10-20-31.ply", "2024-01-02_10-21-02.ply"},
      {"1700000000123456789.ply", "1700000000123456790.ply", "1700000000223456788.ply"}};
  for (const Names& names : series) EXPECT_EQ(ordered(names), names) << names[0];
}

TEST(FrameNames, EvenNumbersAreKept) {
  FrameList list;
  ordered({"f2.ply", "f4.ply", "f10.ply"}, &list);
  EXPECT_EQ(list.numbers, (std::vector<int64_t>{2, 4, 10}));
  ordered({"0.0.ply", "0.05.ply", "0.1.ply", "0.15.ply", "0.25.ply"}, &list);
  EXPECT_EQ(list.numbers, (std::vector<int64_t>{0, 1, 2, 3, 5}));
  EXPECT_NE(all_of(list.remarks).find("20 frames a second"), std::string::npos);
  ordered({"0.0.ply", "0.05.ply", "0.16.ply", "0.9.ply"}, &list);
  EXPECT_TRUE(list.numbers.empty()) << "not even";
}

TEST(FrameNames, WhatIsNoPartOfTheSeriesIsLeftOutAndSaid) {
  FrameList list;
  const Names frames = {"frame_0001.ply", "frame_0002.ply", "frame_0003.ply"};
  for (const Names& strays : {Names{"floor.ply"}, Names{"template.obj", "calibration_1.ply"},
                              Names{"frame.ply"}, Names{"frame_0001_clean.ply"}}) {
    Names all = frames;
    all.insert(all.end(), strays.begin(), strays.end());
    EXPECT_EQ(ordered(all, &list), frames) << strays[0];
    ASSERT_EQ(list.remarks.size(), 1u);
    for (const std::string& stray : strays) EXPECT_HAS(list.remarks[0], stray);
  }
  // Names without numbers are in the order of names, which is said.
  EXPECT_EQ(ordered({"a.ply", "b.ply", "c.ply"}, &list), (Names{"a.ply", "b.ply", "c.ply"}));
  EXPECT_HAS(all_of(list.remarks), "no series of numbers");
  EXPECT_EQ(ordered({"floor.ply"}, &list), Names{"floor.ply"});
  EXPECT_TRUE(list.remarks.empty());
}

TEST(FrameNames, SeveralSeriesAreRefused) {
  for (const Names& names :
       {Names{"left_1.ply", "left_2.ply", "right_1.ply", "right_2.ply"},
        Names{"cam0_0001.ply", "cam0_0002.ply", "cam1_0001.ply", "cam1_0002.ply"},
        Names{"0001_cam0.ply", "0001_cam1.ply", "0002_cam0.ply", "0002_cam1.ply"},
        Names{"c0_1.ply", "c0_2.ply", "c0_3.ply", "c1_1.ply", "c1_2.ply", "c1_3.ply"}})
    EXPECT_HAS(error_of([&] { ordered(names); }), "holds several series of frames") << names[0];
}

// ---- folders -----------------------------------------------------------------------------------

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
