// Tables of points as programs for molecules, faces and statistics write them.
#include <gtest/gtest.h>

#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersTables = FileTest;

const Points kTwo = {{1, 2, 3}, {4, 5, 6}};

TEST_F(ReadersTables, CountsRemarksAndElements) {
  const std::pair<const char*, const char*> files[] = {
      {"a.xyz", "2\nwater, frame 7 of 9\nO 1 2 3\nH 4 5 6\n"},
      {"a.xyz", "2\n\nO 1 2 3\nH 4 5 6\n"},
      {"a.xyz", "  2\n\tsodium\nNa 1 2 3\nCl 4 5 6\n"},
      {"a.xyz", "2\nno elements\n1 2 3\n4 5 6\n"},
      {"a.xyz",
       "2\nLattice=\"1 0 0\" Properties=species:S:1:pos:R:3 energy=-1.5\n8 1 2 3\n1 4 5 6\n"},
      {"a.xyz", "2\n0.1 0.2 0.3\n1 2 3\n4 5 6\n"},
      {"a.xyz", "2\n0.1 0.2 0.3\nO 1 2 3\nH 4 5 6\n"},
      {"a.xyz", "2\nLattice=\"8.4 0 0 0 8.4 0 0 0 8.4\"\nO 1 2 3 0.5\nH 4 5 6 0.5\n"},
      {"a.xyz", "2\n1 2 3\n4 5 6\n"},
      {"a.XYZ", "2\r\nwater\r\nO\t1\t2\t3\r\nH\t4\t5\t6\r\n"},
      {"a.pts", "2\n1 2 3 -1210 10 20 30\n4 5 6 -1000 10 20 30\n"},
      {"a.pts", "2\n1 2 3\n4 5 6\n"},
      {"a.pts", "version: 1\nn_points: 2\n{\n1 2 3\n4 5 6\n}\n"},
      {"a.pts", "version:1\nn_points:  2\n{\n1 2 3\n4 5 6\n}"},
      {"a.csv", "nose,1,2,3\nchin,4,5,6\n"}};
  for (const auto& [name, text] : files)
    EXPECT_EQ(read_mesh(dir.write(name, text)).vertices, kTwo) << text;
}

TEST_F(ReadersTables, WhatIsAnnouncedIsThere) {
  const std::pair<const char*, const char*> files[] = {
      {"3\nwater\nO 1 2 3\nH 4 5 6\n", "holds 2 points, its first line says 3"},
      {"2\nwater\nO 1 2 3\nH 4 5 6\n2\nwater\nO 1 2 3\nH 4 5 6\n",
       "a.xyz:5: another frame begins here"},
      {"version: 1\nn_points: 68\n{\n1 2 3\n}\n", "holds 1 points, its first line says 68"},
      {"version: 1\nn_points: 2\n{\n10.5 20\n11 21\n}\n", "a.xyz:4: holds points of a picture"},
      {"O 1 2 3\nH 4 5\n", "a.xyz:2: has 3 columns"}};
  for (const auto& [text, says] : files)
    EXPECT_HAS(error_of([&, t = text] { read_mesh(dir.write("a.xyz", t)); }), says) << text;
}

TEST_F(ReadersTables, MissingNumbersAreLeftOutAndCounted) {
  const std::pair<const char*, const char*> files[] = {
      {"a.csv", "x,y,z\n1,2,3\nNULL,2,3\n4,5,6\n1,NA,3\n1,2,N/A\n"},
      {"a.csv", "NULL;NULL;NULL\n1;2;3\n4;5;6\n;;\n--;--;--\n"},
      {"a.csv", "x,y,z,i\n1,2,3,9\n,,,\nnull,null,null,9\n4,5,6,9\n#N/A,2,3,9\n"},
      {"a.txt", "1 2 3\nNA NA NA\n4 5 6\n-- -- --\n- 1 2\n"},
      {"a.txt", "x\ty\tz\n1\t2\t3\n\t\t\n4\t5\t6\n\t2\t3\n1\t\t3\n"},
      {"a.xyz", "1 2 3\nNone None None\n4 5 6\nn/a 1 2\nnan inf 3\n"}};
  for (const auto& [name, text] : files) {
    size_t left_out = 0;
    EXPECT_EQ(read_frame_mesh(dir.write(name, text), left_out).vertices, kTwo) << text;
    EXPECT_EQ(left_out, 3u) << text;
  }
  EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.csv", "1,2,3\n1,two,3\n")); }),
             "'two' is no number");
}

}  // namespace
}  // namespace restage
