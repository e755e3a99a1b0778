// Tables that hold several frames, one below the other, or a column that is no coordinate.
#include <gtest/gtest.h>

#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersFrameColumns = FileTest;

/// A line of a table for each point of each frame.
template <class Line>
std::string table(int frames, int points, const Line& line, bool points_first = false) {
  std::string out;
  for (int a = 0; a < (points_first ? points : frames); ++a)
    for (int b = 0; b < (points_first ? frames : points); ++b)
      out += line(points_first ? b : a, points_first ? a : b) + "\n";
  return out;
}

/// Coordinates with marks between them.
std::string xyz(int f, int i, const std::string& mark) {
  return cat(0.25 * ((7 * i) % 11) + 0.001 * f, mark, 0.1 * i + 0.003, mark, -0.3 * ((5 * i) % 7));
}

TEST_F(ReadersFrameColumns, AColumnThatNumbersFramesIsNoCoordinate) {
  const auto in_front = [](int f, int i) { return cat(f, ",", xyz(f, i, ",")); };
  const auto behind = [](int f, int i) { return cat(xyz(f, i, " "), " ", f + 10); };
  const auto in_steps = [](int f, int i) { return cat(5 * f, ";", xyz(f, i, ";"), ";255"); };
  const auto time = [](int f, int i) { return cat(0.0333 * f, "\t", xyz(f, i, "\t")); };
  const auto word = [](int f, int i) { return cat("frame_", f, ",", xyz(f, i, ",")); };
  const auto point_too = [](int f, int i) { return cat(i, ",", f, ",", xyz(f, i, ",")); };
  const std::string tables[] = {table(3, 20, in_front),     table(2, 2, in_front),
                                table(3, 20, behind),       table(4, 9, in_steps),
                                table(3, 20, time),         table(3, 20, word),
                                table(3, 20, point_too),    table(3, 20, in_front, true),
                                table(3, 20, behind, true), table(3, 20, point_too, true)};
  for (const std::string& text : tables)
    for (const char* name : {"a.csv", "a.txt", "a.xyz"}) {
      const std::string said = error_of([&] { read_mesh(dir.write(name, text)); });
      EXPECT_HAS(said, "numbers frames, and a table is one frame") << text.substr(0, 80);
      EXPECT_HAS(said, "write each frame into a file of its own");
      EXPECT_HAS(said, "name the columns in a first line");
    }
}

TEST_F(ReadersFrameColumns, AFirstLineSaysWhatAColumnIs) {
  const auto behind = [](int f, int i) { return cat(xyz(f, i, " "), " ", f); };
  EXPECT_EQ(read_mesh(dir.write("a.txt", "x y z label\n" + table(3, 20, behind))).vertices.size(),
            60u);
  for (const char* header : {"x y z frame\n", "X Y Z Frame_No\n", "x y z time\n"}) {
    const std::string text = header + table(3, 20, behind);
    EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.txt", text)); }), "another frame begins here")
        << header;
  }
  // In the order of points each row is of another frame.
  EXPECT_HAS(error_of([&] {
               read_mesh(dir.write("a.txt", "x y z frame\n" + table(3, 20, behind, true)));
             }),
             "column 4 (0 to 2) numbers frames");
  // Times of a scanner are not those of frames.
  const auto times = [](int, int i) { return cat(xyz(0, i, " "), " ", 0.001 * i); };
  EXPECT_EQ(read_mesh(dir.write("a.txt", "x y z t\n" + table(1, 60, times))).vertices.size(), 60u);
}

TEST_F(ReadersFrameColumns, TheNumberOfTheOnlyFrameIsNoCoordinate) {
  const auto in_front = [](int, int i) { return cat("7,", xyz(0, i, ",")); };
  EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.csv", table(1, 20, in_front))); }),
             "its first column is the same in all rows");
  const auto from_100 = [](int, int i) { return cat(100 + i, ",", xyz(0, i, ",")); };
  const Points points = read_mesh(dir.write("a.csv", table(1, 20, from_100))).vertices;
  EXPECT_EQ(points,
            read_mesh(dir.write("b.csv", table(1, 20, [](int, int i) { return xyz(0, i, ","); })))
                .vertices);
}

TEST_F(ReadersFrameColumns, ColoursLabelsAndGridsStay) {
  const auto coloured = [](int, int i) {
    return cat(xyz(0, i, " "), " ", (37 * i) % 256, " ", (91 * i) % 256, " 255");
  };
  EXPECT_EQ(read_mesh(dir.write("a.xyz", table(1, 60, coloured))).vertices.size(), 60u);
  const auto grid = [](int f, int i) { return cat(0.1 * i, " ", 0.05 * f, " ", (3 * i) % 5); };
  EXPECT_EQ(read_mesh(dir.write("a.xyz", table(5, 12, grid))).vertices.size(), 60u);
  const auto confidence = [](int f, int i) { return cat(xyz(f, i, " "), " ", (2 * i) % 3); };
  EXPECT_EQ(read_mesh(dir.write("a.xyz", table(5, 12, confidence))).vertices.size(), 60u);
}

TEST_F(ReadersFrameColumns, CommasAreNotBothMarks) {
  for (const char* text : {"0,512,1,204,0,031\n0,513,1,207,0,112\n", "-0,5,1,2,0,3\n0,5,1,2,0,3\n",
                           "0,05,1,25,0,31\n0,06,1,26,0,32\n"})
    EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.csv", text)); }),
               "has commas both between its columns and before decimals")
        << text;
  EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.csv", "x,y,z\n0,512,1,204,0,331\n")); }),
             "has commas both");
  EXPECT_EQ(read_mesh(dir.write("a.csv", "1,2,3,10,20,30\n4,5,6,7,8,9\n")).vertices.size(), 2u);
}

}  // namespace
}  // namespace restage
