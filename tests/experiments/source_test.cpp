#include "experiments/source.h"

#include <gtest/gtest.h>

#include <cmath>

#include "experiments/pictures/clips.h"
#include "nn/geometry/mesh_file.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;

class SourceTest : public FileTest {
 protected:
  /// Frame f is one point (f, 1, 2).
  void write_frames(const std::string& folder, int count) {
    for (int f = 0; f < count; ++f)
      dir.write(folder + "/f" + std::to_string(f) + ".ply",
                ply_bytes({Point(static_cast<float>(f), 1, 2)}, {}, false));
  }
  void write_scans(const std::string& name, const std::vector<Points>& frames, double fps) {
    ScanWriter writer(dir / name, {}, fps);
    for (const Points& points : frames) writer.append(points);
    writer.commit();
  }
};

/// Of each frame the x of its first point; -1: it has a fault.
std::vector<float> read(Source& source) {
  std::vector<float> out;
  while (const auto cloud = source.next())
    out.push_back(cloud->fault ? -1 : cloud->frame.points.at(0).x());
  return out;
}

using Xs = std::vector<float>;

TEST_F(SourceTest, ADamagedFrameDoesNotEndTheSequence) {
  write_frames("scans", 5);
  dir.write("scans/f2.ply", bytes_of(dir / "scans/f2.ply").substr(0, 20));
  Source source({.path = dir / "scans"});
  for (int round = 0; round < 2; ++round, source.rewind())
    EXPECT_EQ(read(source), (Xs{0, 1, -1, 3, 4}));
  source.skip(2);
  const auto bad = source.next();
  EXPECT_HAS(std::string(bad->fault->what()), "f2.ply");
  source.skip(1);
  EXPECT_EQ(source.next()->frame.points[0].x(), 4);
  EXPECT_FALSE(source.next());
}

TEST_F(SourceTest, SoDoesAnEmptyOrADamagedOneOfOneFile) {
  write_scans("scans.h5", {{{0, 1, 2}}, {}, {{2, 1, 2}}, {{3, 1, 2}}}, 60);
  Source source({.path = dir / "scans.h5"});
  EXPECT_EQ(source.fps(), 60);
  EXPECT_EQ(read(source), (Xs{0, -1, 2, 3}));
  EXPECT_EQ(Source({.path = dir / "scans.h5", .fps = 20}).record().fps, 20);
}

TEST_F(SourceTest, FramesComeInMetresAndUpright) {
  write_frames("scans", 1);
  const Point expected[] = {Point(0, 1, 2), Point(0, -1, -2), Point(0, 2, -1), Point(0, -2, 1)};
  const char* ups[] = {"y", "-y", "z", "-z"};
  for (int k = 0; k < 4; ++k) {
    Source source({.path = dir / "scans", .scale = 0.5, .up = ups[k]});
    EXPECT_EQ(source.next()->frame.points[0], 0.5f * expected[k]) << ups[k];
  }
  for (const std::string up : {"x", "-x"}) {
    Source source({.path = dir / "scans", .up = up});
    EXPECT_EQ(std::abs(source.next()->frame.points[0].y()), 0) << up;
  }
  for (const std::string up : {"auto", "w", ""})
    EXPECT_THROW(Source({.path = dir / "scans", .up = up}), InputError) << up;
  for (const double scale : {0.0, -1.0, 1e300, std::nan("")})
    EXPECT_THROW(Source({.path = dir / "scans", .scale = scale}), InputError) << scale;
  for (const double fps : {0.0, -1.0, 1e9, std::nan("")})
    EXPECT_THROW(Source({.path = dir / "scans", .fps = fps}), InputError) << fps;
}

TEST_F(SourceTest, AClipShowsTheNearestFrameInThePlaceOfABadOne) {
  write_frames("scans", 5);
  for (const std::string bad : {"f0", "f1", "f3"}) dir.write("scans/" + bad + ".ply", "ply\n");
  Remarks remarks;
  const Clip clip = read_clip({.path = dir / "scans"}, "source", kMaxMemory, remarks);
  std::vector<float> shown;
  for (const Points& points : clip.frames) shown.push_back(points[0].x());
  EXPECT_EQ(shown, (Xs{2, 2, 2, 2, 4}));
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_HAS(remarks[0], "3 of the frames");
  EXPECT_HAS(remarks[0], "f0.ply");
  EXPECT_HAS(refusal_of([&] { read_clip(dir / "scans", "source"); }), "f0.ply");
  for (const std::string bad : {"f2", "f4"}) dir.write("scans/" + bad + ".ply", "ply\n");
  EXPECT_HAS(refusal_of([&] { read_clip(dir / "scans", "source"); }), "f0.ply");
}

}  // namespace
}  // namespace restage
