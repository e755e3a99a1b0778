// Which names of files are a sequence, and in which order.
#include <gtest/gtest.h>

#include <algorithm>

#include "autograd/base/error.h"
#include "datasets/readers/frames/frame_names.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;

std::string joined(const std::vector<std::string>& remarks) {
  std::string out;
  for (const std::string& remark : remarks) out += remark + "\n";
  return out;
}

/// The order of these names, whatever order they come in.
Names ordered(Names names, FrameList* list = nullptr) {
  std::sort(names.begin(), names.end());
  const FrameList out = order_frames(names, "in");
  if (list != nullptr) *list = out;
  return out.files;
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
  EXPECT_NE(joined(list.remarks).find("20 frames a second"), std::string::npos);
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
  EXPECT_HAS(joined(list.remarks), "no series of numbers");
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

TEST(FrameNames, AFrameThatIsThereTwiceIsRefused) {
  for (const Names& names :
       {Names{"f0.ply", "f00.ply", "f1.ply"}, Names{"frame_0000.ply", "frame_0.obj"},
        Names{"a_001.ply", "a_01.xyz", "a_2.ply"}, Names{"take1.5.ply", "take01.5.ply"},
        Names{"0.5.ply", "00.5.obj", "0.75.ply"}, Names{"-1.ply", "-01.ply", "0.ply"}}) {
    const std::string said = error_of([&] { ordered(names); });
    EXPECT_HAS(said, "in: holds one frame twice") << names[0];
    EXPECT_HAS(said, names[0]);
    EXPECT_HAS(said, names[1]);
    EXPECT_HAS(said, "keep one of the two");
  }
}

TEST(FrameNames, DecimalCommasAreDecimals) {
  FrameList list;
  const Names series[] = {
      {"scan_0,0.ply", "scan_0,05.ply", "scan_0,1.ply", "scan_0,15.ply", "scan_0,2.ply"},
      {"9,75.ply", "10.ply", "10,25.ply", "10,5.ply"},
      {"t=-0,5.ply", "t=-0,25.ply", "t=0,0.ply", "t=0,25.ply"}};
  for (const Names& names : series) EXPECT_EQ(ordered(names, &list), names) << names[0];
  ordered(series[0], &list);
  EXPECT_EQ(list.numbers, (std::vector<int64_t>{0, 1, 2, 3, 4}));
  EXPECT_HAS(joined(list.remarks), "'scan_0,05' comes before 'scan_0,2'");
  EXPECT_HAS(joined(list.remarks), "20 frames a second");
  // Thousands, or decimals?
  EXPECT_HAS(error_of([] {
               ordered({"998.ply", "999.ply", "1,000.ply", "1,001.ply"});
             }),
             "cannot be told");
}

TEST(FrameNames, NanosecondsWithoutZerosInFront) {
  FrameList list;
  const Names series[] = {
      {"1700000000.99999999.pcd", "1700000000.100000000.pcd", "1700000001.5.pcd"},
      {"1700000000.33333333.pcd", "1700000000.66666666.pcd", "1700000000.133333332.pcd",
       "1700000000.199999998.pcd"},
      {"12.5000.ply", "12.333333333.ply", "12.666661666.ply", "13.1000.ply"},
      {"7.99999999.ply", "7.133333333.ply", "7.166666667.ply", "7.200000000.ply"}};
  for (const Names& names : series) {
    EXPECT_EQ(ordered(names, &list), names) << names[0];
    EXPECT_HAS(joined(list.remarks), "seconds and nanoseconds") << names[0];
  }
  ordered({"1700000000.966666666.pcd", "1700000001.0.pcd", "1700000001.33333333.pcd",
           "1700000001.100000000.pcd"},
          &list);
  EXPECT_EQ(list.numbers, (std::vector<int64_t>{0, 1, 2, 4}));
  EXPECT_HAS(joined(list.remarks), "30 frames a second");
  // Seconds with a zero behind the point are decimals, however many digits they have.
  const Names decimals = {"1700000000.033333333.pcd", "1700000000.06.pcd", "1700000000.1.pcd"};
  EXPECT_EQ(ordered(decimals), decimals);
}

TEST(FrameNames, WhatCannotBeToldIsRefusedAndWhatIsChosenIsSaid) {
  for (const Names& names : {Names{"take1.9.ply", "take1.11.ply"}, Names{"0.5.ply", "0.50.ply"},
                             Names{"t0.5.ply", "t0.50.ply", "t0.75.ply"}}) {
    const std::string said = error_of([&] { ordered(names); });
    EXPECT_HAS(said, "cannot be told") << names[0];
    EXPECT_HAS(said, "as many digits behind the point");
  }
  FrameList list;
  ordered({"take1.8.ply", "take1.9.ply", "take1.10.ply"}, &list);
  EXPECT_HAS(joined(list.remarks),
             "read as numbers of their own: 'take1.9' comes before 'take1.10'");
  ordered({"100.0.ply", "100.05.ply", "100.1.ply"}, &list);
  EXPECT_HAS(joined(list.remarks), "read as decimals: '100.05' comes before '100.1'");
  ordered({"1.08.ply", "1.09.ply", "1.10.ply"}, &list);
  EXPECT_TRUE(joined(list.remarks).find("read as") == std::string::npos) << "one order anyway";
}

TEST(FrameNames, HexadecimalNumbers) {
  const Names series[] = {{"frame_08.ply", "frame_09.ply", "frame_0a.ply", "frame_0b.ply",
                           "frame_0f.ply", "frame_10.ply", "frame_11.ply"},
                          {"frame9.ply", "framea.ply", "frameb.ply", "framec.ply", "framed.ply",
                           "framee.ply", "framef.ply", "frame10.ply"},
                          {"0E.ply", "0F.ply", "10.ply", "11.ply"},
                          {"cam1_1fe_mesh.ply", "cam1_1ff_mesh.ply", "cam1_200_mesh.ply"}};
  for (const Names& names : series) {
    FrameList list;
    EXPECT_EQ(ordered(names, &list), names) << names[0];
    EXPECT_HAS(joined(list.remarks), "hexadecimal") << names[0];
    EXPECT_FALSE(list.numbers.empty()) << names[0];
  }
  FrameList list;
  Names all = series[0];
  all.push_back("floor.ply");
  EXPECT_EQ(ordered(all, &list), series[0]);
  EXPECT_EQ(list.numbers.back(), 17);
  EXPECT_HAS(joined(list.remarks), "floor.ply");
  // A frame that was mended by hand is no hexadecimal number.
  EXPECT_EQ(ordered({"f_1.ply", "f_2.ply", "f_2a.ply", "f_3.ply"}, &list),
            (Names{"f_1.ply", "f_2.ply", "f_3.ply"}));
  EXPECT_HAS(joined(list.remarks), "f_2a.ply");
}

TEST(FrameNames, CopiesWhoseFirstHasNoNumber) {
  FrameList list;
  for (const Names& names :
       {Names{"scan.ply", "scan (1).ply", "scan (2).ply", "scan (10).ply"},
        Names{"scan.ply", "scan (1).ply"}, Names{"a_7.ply", "a_7(1).ply", "a_7(2).ply"},
        Names{"scan.ply", "scan 2.ply", "scan 3.ply", "scan 10.ply"}}) {
    EXPECT_EQ(ordered(names, &list), names) << names[1];
    EXPECT_HAS(joined(list.remarks),
               "'" + names[0] + "' is taken for the frame before '" + names[1]);
  }
  for (const Names& names : {Names{"scan.ply", "scan_1.ply", "scan_2.ply"},
                             Names{"scan.ply", "scan-1.ply", "scan-2.ply"},
                             Names{"mesh.obj", "mesh.001.obj", "mesh.002.obj"},
                             Names{"scan.ply", "scan_2.ply", "scan_3.ply"},
                             Names{"scan.ply", "scan 1.ply", "scan 2.ply"},
                             Names{"scan.ply", "scan1.ply", "scan2.ply", "scan10.ply"}}) {
    EXPECT_EQ(ordered(names, &list), names) << names[1];
    EXPECT_HAS(joined(list.remarks),
               "'" + names[0] + "' is taken for the frame before '" + names[1]);
  }
  // Frame 0 is there, or the numbers are a program's.
  for (const char* second : {"scan_0.ply", "scan_5.ply", "scan_001.ply"})
    EXPECT_EQ(ordered({"scan.ply", second, "scan_17.ply"}, &list), (Names{second, "scan_17.ply"}));
  // Of a numbered frame it is another download of that frame.
  EXPECT_EQ(ordered({"f_1.ply", "f_2.ply", "f_2 (1).ply", "f_3.ply"}, &list),
            (Names{"f_1.ply", "f_2.ply", "f_3.ply"}));
  EXPECT_HAS(joined(list.remarks), "f_2 (1).ply");
}

TEST(FrameNames, CopiesOfAFileAreNoFrames) {
  for (const Names& names : {Names{"scan.ply", "scan - Copy.ply"},
                             Names{"scan.ply", "scan - Copy.ply", "scan - Copy (2).ply"},
                             Names{"scan.ply", "scan - Kopie.ply"},
                             Names{"scan.ply", "scan copy.ply", "scan copy 2.ply"},
                             Names{"scan.ply", "Copy of scan.ply"}}) {
    const std::string said = error_of([&] { ordered(names); });
    EXPECT_HAS(said, "by its name a copy of 'scan.ply'") << names[1];
    EXPECT_HAS(said, "remove the copies");
  }
  FrameList list;
  EXPECT_EQ(ordered({"f_1.ply", "f_2.ply", "f_1 - Copy.ply", "f_2 - Copy.ply", "f_3.ply"}, &list),
            (Names{"f_1.ply", "f_2.ply", "f_3.ply"}));
  EXPECT_HAS(joined(list.remarks), "left out 'f_1 - Copy.ply', 'f_2 - Copy.ply'");
}

TEST(FrameNames, CamerasAreNoFrames) {
  for (const Names& names :
       {Names{"cam0.ply", "cam1.ply"}, Names{"Kinect_1.ply", "Kinect_2.ply", "Kinect_3.ply"},
        Names{"scan_camera01.pcd", "scan_camera02.pcd"}, Names{"view 1.ply", "view 2.ply"},
        Names{"left.ply", "right.ply"}, Names{"cam_back.ply", "cam_front.ply"}})
    EXPECT_HAS(error_of([&] { ordered(names); }), "holds clouds of several cameras") << names[0];
  for (const Names& names :
       {Names{"cam0_0001.ply", "cam0_0002.ply"}, Names{"camera_0001.ply", "camera_0002.ply"},
        Names{"scam1.ply", "scam2.ply"}, Names{"left_1.ply", "left_2.ply"}})
    EXPECT_EQ(ordered(names), names) << names[0];
}

TEST(FrameNames, DigitsOfOtherScriptsAndPowersOfTen) {
  FrameList list;
  const Names series[] = {
      {"\xEF\xBC\x99.ply", "\xEF\xBC\x91\xEF\xBC\x90.ply", "11.ply"},  // full-width 9, 10
      {"\xD9\xA9.ply", "\xD9\xA1\xD9\xA0.ply"},                        // Arabic
      {"1e-1.ply", "2e-1.ply", "9e-1.ply", "1e+0.ply", "1.1e+0.ply", "1e+1.ply"},
      {"0.0.ply", "5e-05.ply", "0.0001.ply", "0.00015.ply"},
      {"t_1.0e-02.ply", "t_2.0e-02.ply", "t_1.1e-01.ply"}};
  for (const Names& names : series) EXPECT_EQ(ordered(names, &list), names) << names[0];
  for (const Names& names :
       {Names{"-0.ply", "0.ply", "1.ply"}, Names{"-0.0.ply", "0.0.ply", "0.5.ply"},
        Names{"\xEF\xBC\x91.ply", "1.ply", "2.ply"}})
    EXPECT_HAS(error_of([&] { ordered(names); }), "holds one frame twice") << names[0];
  const Names words = {"scene1e-2.ply", "scene2e-2.ply"};
  EXPECT_EQ(ordered(words), words);
}

TEST(FrameNames, MarkedHexadecimalNumbers) {
  FrameList list;
  for (const Names& names : {Names{"0x08.ply", "0x09.ply", "0x10.ply", "0x11.ply"},
                             Names{"f_0X9.ply", "f_0XA.ply", "f_0X10.ply"},
                             Names{"scan0xff_a.ply", "scan0x100_a.ply"}}) {
    EXPECT_EQ(ordered(names, &list), names) << names[0];
    EXPECT_HAS(joined(list.remarks), "hexadecimal") << names[0];
  }
  ordered({"0x08.ply", "0x09.ply", "0x10.ply", "0x11.ply"}, &list);
  EXPECT_EQ(list.numbers, (std::vector<int64_t>{8, 9, 16, 17}));
  const Names pictures = {"640x480_9.ply", "640x480_10.ply"};
  EXPECT_EQ(ordered(pictures, &list), pictures);
  EXPECT_TRUE(joined(list.remarks).find("hexadecimal") == std::string::npos);
}

TEST(FrameNames, MembersOfAFileAreNotCalledFolders) {
  const std::string said = error_of([] { order_members({"a 1", "a 2", "b 1", "b 2"}, "x.h5"); });
  EXPECT_HAS(said, "put each series into a file of its own");
}

}  // namespace
}  // namespace restage
