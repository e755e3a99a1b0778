// Frames that lie in one array of points or in flat rows, in NPZ and HDF5.
#include <gtest/gtest.h>

#include <cmath>

#include "datasets/hdf5/file.h"
#include "datasets/readers/clouds/point_path.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/frame_folder.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersRagged = FileTest;

using Arrays = std::vector<std::pair<std::string, std::string>>;

std::string whole(const std::vector<int64_t>& values) {
  return npy<int64_t>({std::ssize(values)}, values);
}

/// 12 points whose x counts them.
std::vector<float> counted() {
  std::vector<float> out;
  for (int i = 0; i < 12; ++i) {
    out.push_back(static_cast<float>(i));
    out.push_back(static_cast<float>((5 * i) % 7));
    out.push_back(1);
  }
  return out;
}

/// The first point's x and the number of points, of each frame.
std::vector<std::pair<float, size_t>> frames_of(FrameSource& frames) {
  std::vector<std::pair<float, size_t>> out;
  while (const auto frame = frames.next())
    out.emplace_back(frame->points.empty() ? -1.0f : frame->points[0].x(), frame->points.size());
  return out;
}

const std::vector<std::pair<float, size_t>> kParted = {{0, 5}, {5, 3}, {8, 4}};

/// Names and numbers that part 12 points as kParted says.
const std::pair<const char*, std::vector<int64_t>> kParts[] = {
    {"lengths", {5, 3, 4}},
    {"num_points", {5, 3, 4}},
    {"points_per_frame", {5, 3, 4}},
    {"frame_offset", {0, 5, 8, 12}},
    {"offsets", {0, 5, 8}},
    {"splits", {5, 8, 12}},
    {"row_splits", {0, 5, 8, 12}},
    {"frame_id", {3, 3, 3, 3, 3, 4, 4, 4, 7, 7, 7, 7}},
    {"batch", {0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2}},
    {"whatever", {5, 3, 4}},
    {"frame_starts", {0, 5, 8}},
    {"ends", {5, 8, 12}}};

TEST_F(ReadersRagged, WholeNumbersBesidePointsPartThemIntoFrames) {
  const std::string points = npy<float>({12, 3}, counted());
  std::string columns;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 12; ++i) columns += raw(counted()[static_cast<size_t>(3 * i + axis)]);
  const std::string by_columns = npy_of(npy_header("<f4", {12, 3}, true), columns);
  for (const auto& [name, numbers] : kParts)
    for (const std::string& array : {points, by_columns}) {
      dir.write("a.npz", npz({{"points", array}, {name, whole(numbers)}}));
      const auto frames = open_frames(dir / "a.npz");
      EXPECT_EQ(frames->frames(), 3) << name;
      EXPECT_EQ(frames_of(*frames), kParted) << name;
      frames->rewind();
      frames->skip();
      EXPECT_EQ(frames->next()->points.size(), 3u) << name;
      EXPECT_HAS(frames->remarks().at(0), cat("'", name, "' parts its 12 points")) << name;
      EXPECT_TRUE(find_cloud(dir / "a.npz")->axes.sequence);
    }
}

TEST_F(ReadersRagged, NumbersThatDoNotFitAreRefused) {
  const std::string points = npy<float>({12, 3}, counted());
  for (const auto& [name, numbers] : std::vector<std::pair<const char*, std::vector<int64_t>>>{
           {"lengths", {5, 3, 5}},
           {"num_points", {5, 3}},
           {"frame_offset", {0, 5, 13}},
           {"frame_offset", {1, 5, 8}},
           {"splits", {0, 8, 5, 12}},
           {"frame_id", {0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2}}}) {
    dir.write("a.npz", npz({{"points", points}, {name, whole(numbers)}}));
    EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "does not part them into frames")
        << name;
  }
  // What says nothing of frames.
  for (const Arrays& beside :
       {Arrays{{"labels", whole(std::vector<int64_t>(12, 3))}},
        Arrays{{"offset", whole({7, 9, 4})}}, Arrays{{"num_points", npy<int64_t>({}, {12})}},
        Arrays{{"faces", npy<int64_t>({1, 3}, {0, 1, 2})}},
        Arrays{{"frame_id", npy<int64_t>({}, {40})}},
        Arrays{{"lengths", npy<float>({2}, {0.3f, 0.4f})}}}) {
    Arrays all = beside;
    all.emplace_back("points", points);
    dir.write("a.npz", npz(all));
    EXPECT_EQ(open_frames(dir / "a.npz")->frames(), 1) << beside[0].first;
  }
}

TEST_F(ReadersRagged, DataSetsOfHdf5AreTakenInTheSameWay) {
  for (const auto& [name, numbers] : kParts) {
    {
      h5::File file = h5::File::create(dir / "a.h5");
      file.write<float>("/scan/xyz", {12, 3}, counted());
      file.write<int64_t>(cat("/scan/", name), {std::ssize(numbers)}, numbers);
      file.commit();
    }
    const auto frames = open_frames(dir / "a.h5");
    EXPECT_EQ(frames_of(*frames), kParted) << name;
  }
}

// ---- flat rows ---------------------------------------------------------------------------------

/// Vertex i of frame f, in rows of x y z one after the other.
std::vector<float> flat(int frames, int points) {
  std::vector<float> out;
  for (int f = 0; f < frames; ++f)
    for (int i = 0; i < points; ++i) {
      const auto t = static_cast<float>(i);
      out.push_back(std::sin(t) + 0.01f * static_cast<float>(f));
      out.push_back(0.02f * t);
      out.push_back(std::cos(2 * t));
    }
  return out;
}

TEST_F(ReadersRagged, FlatRowsAreToldOrUnderstood) {
  for (const int f : {1, 5, 20}) {
    const std::string rows = npy<float>({f, 240}, flat(f, 80));
    for (const std::string& path :
         {dir.write("a.npy", rows), dir.write("a.npz", npz({{"vertices", rows}})),
          dir.write("b.npz", npz({{"motion", rows}}))}) {
      const std::string said = error_of([&] { open_frames(path); });
      EXPECT_HAS(said, "is a flat array") << path << f;
      EXPECT_HAS(said, cat("array.reshape(", f, ", 80, 3)"));
    }
    const std::string faces = npy<int64_t>({2, 3}, {0, 1, 2, 5, 7, 79}),
                      rest = npy<float>({80, 3}, flat(1, 80));
    for (const Arrays& beside : {Arrays{{"faces", faces}}, Arrays{{"v_template", rest}}}) {
      Arrays all = beside;
      all.emplace_back("vertices", rows);
      dir.write("c.npz", npz(all));
      const auto frames = open_frames(dir / "c.npz");
      EXPECT_EQ(frames->frames(), f);
      for (int k = 1; k < f; ++k) frames->skip();
      const auto last = frames->next();
      EXPECT_EQ(last->points.size(), 80u);
      EXPECT_FLOAT_EQ(last->points[3].y(), 0.06f);
      EXPECT_FLOAT_EQ(last->points[0].x(), 0.01f * static_cast<float>(f - 1));
    }
    {
      h5::File file = h5::File::create(dir / "a.h5");
      file.write<float>("/vertices", {f, 240}, flat(f, 80));
      file.commit();
    }
    EXPECT_HAS(error_of([&] { open_frames(dir / "a.h5"); }), "array.reshape");
  }
  EXPECT_HAS(error_of([&] { open_frames(dir.write("d.npy", npy<float>({240}, flat(1, 80)))); }),
             "array.reshape(80, 3)");
}

TEST_F(ReadersRagged, RecordsOfPointsAreRead) {
  const std::string fields = "{'descr': [('x', '<f4'), ('y', '<f4'), ('z', '<f4')";
  const std::string behind = "], 'fortran_order': False, 'shape': (5,), }";
  std::string plain, coloured, mixed;
  Points all;
  for (const float at : {1.0f, 4.0f, 7.0f, 10.0f, 13.0f}) {
    all.emplace_back(at, at + 1, at + 2);
    const std::string xyz = raw(at) + raw(at + 1) + raw(at + 2);
    plain += xyz;
    coloured += xyz + raw(uint32_t{0xff00ff});
    mixed += xyz + "c";
  }
  dir.write("a.npy", npy_of(fields + behind, plain));
  EXPECT_EQ(open_frames(dir / "a.npy")->next()->points, all);
  dir.write("a.npy", npy_of(fields + ", ('rgb', '<u4')" + behind, coloured));
  EXPECT_EQ(open_frames(dir / "a.npy")->next()->points, all);
  dir.write("a.npy", npy_of(fields + ", ('c', '|u1')" + behind, mixed));
  const std::string said = error_of([&] { open_frames(dir / "a.npy"); });
  EXPECT_HAS(said, "records of the fields x, y, z, c");
  EXPECT_HAS(said, "numpy.stack([a['x'], a['y'], a['z']], -1)");
}

// ---- HDF5 --------------------------------------------------------------------------------------

TEST_F(ReadersRagged, NumberedGroupsAreFrames) {
  const auto write = [&](const char* name, const std::vector<std::string>& groups) {
    h5::File file = h5::File::create(dir / name);
    for (size_t f = 0; f < groups.size(); ++f) {
      std::vector<float> points = counted();
      points.resize(3 * (6 + f));
      file.write<float>(groups[f] + "/points", {static_cast<int64_t>(6 + f), 3}, points);
      file.write<int64_t>(groups[f] + "/faces", {1, 3}, {0, 1, 2});
    }
    file.commit();
  };
  write("a.h5", {"/frames/000", "/frames/001", "/frames/002"});
  write("b.h5", {"/0009", "/0010", "/0011"});
  write("c.h5", {"/data/scan/seq/frame_9", "/data/scan/seq/frame_10"});
  for (const char* name : {"a.h5", "b.h5"}) {
    const auto frames = open_frames(dir / name);
    EXPECT_EQ(frames_of(*frames), (std::vector<std::pair<float, size_t>>{{0, 6}, {0, 7}, {0, 8}}))
        << name;
  }
  EXPECT_EQ(open_frames(dir / "c.h5")->frames(), 2);
  write("d.h5", {"/cam0", "/cam1"});
  EXPECT_HAS(error_of([&] { open_frames(dir / "d.h5"); }), "clouds of several cameras");
  write("e.h5", {"/a/1", "/a/2", "/b/1", "/b/2"});
  const std::string said = error_of([&] { open_frames(dir / "e.h5"); });
  EXPECT_HAS(said, "holds several series");
  EXPECT_EQ(said.find("folder"), std::string::npos) << said;
}

TEST_F(ReadersRagged, ABodyModelsParametersInHdf5AreSaid) {
  h5::File file = h5::File::create(dir / "a.h5");
  file.write<float>("/smpl/poses", {9, 72}, std::vector<float>(648, 0));
  file.write<float>("/smpl/trans", {9, 3}, std::vector<float>(27, 0));
  file.write<float>("/smpl/betas", {10}, std::vector<float>(10, 0));
  file.commit();
  const std::string said = error_of([&] { open_frames(dir / "a.h5"); });
  EXPECT_HAS(said, "holds a motion of a body model");
  EXPECT_HAS(said, "numpy.savez");
}

// ---- rings -------------------------------------------------------------------------------------

/// Rings of a lidar around somebody of 1.7 m, from below upwards; `arc` of each is seen.
Points rings(int count, int points, double arc, bool back_and_forth, bool z_up) {
  Points out;
  for (int r = 0; r < count; ++r) {
    const double height = 0.1 + 1.5 * r / (count - 1), width = 0.16 + 0.05 * std::sin(2.0 * r);
    for (int i = 0; i < points; ++i) {
      const int k = back_and_forth && r % 2 == 1 ? points - 1 - i : i;
      const double a = arc * k / points;
      const auto x = static_cast<float>(1.2 * width * std::cos(a)),
                 y = static_cast<float>(height + 0.004 * std::sin(9.0 * i)),
                 z = static_cast<float>(width * std::sin(a));
      out.push_back(z_up ? Point(x, z, y) : Point(x, y, z));
    }
  }
  return out;
}

TEST(PointPath, RingsOfALidarAreNoPath) {
  for (const int count : {3, 5, 8, 16, 32})
    for (const int points : {40, 120, 400})
      for (const bool z_up : {false, true})
        for (const bool back : {false, true}) {
          EXPECT_FALSE(is_path(rings(count, points, 6.2, false, z_up))) << count << " " << points;
          EXPECT_FALSE(is_path(rings(count, points, 3.4, back, z_up))) << count << " " << points;
        }
}

TEST(PointPath, WaysOfRootsAndHandsStayPaths) {
  Points walk, hand, circle;
  for (int f = 0; f < 240; ++f) {
    const double t = f / 30.0;
    const auto bob = static_cast<float>(0.03 * std::sin(12 * t));
    walk.push_back(Point(static_cast<float>(1.2 * t), 0.95f + bob, 0.02f));
    hand.push_back(Point(static_cast<float>(1.2 * t + 0.25 * std::sin(6 * t)),
                         static_cast<float>(0.8 + 0.1 * std::cos(6 * t)), 0.3f));
    circle.push_back(
        Point(static_cast<float>(std::cos(t)), 0.95f + bob, static_cast<float>(std::sin(t))));
  }
  EXPECT_TRUE(is_path(walk));
  EXPECT_TRUE(is_path(hand));
  EXPECT_TRUE(is_path(circle));
}

}  // namespace
}  // namespace restage
