// What sensors and data sets bring: bare numbers, recordings in one table, COLMAP, splats, windows
// and frames that were filled up.
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/hdf5/file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/table_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/frame_folder.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersSensors = FileTest;

/// Coordinate `axis` of point i of frame f, spread over a person's box and never zero.
float coordinate_of(int f, int i, int axis) {
  return 0.01f + 0.37f * static_cast<float>((i * (axis + 3) * 7 + f) % 11) + 0.001f * f;
}

std::vector<float> cloud_of(int frames, int points) {
  std::vector<float> out;
  for (int f = 0; f < frames; ++f)
    for (int i = 0; i < points; ++i)
      for (int axis = 0; axis < 3; ++axis) out.push_back(coordinate_of(f, i, axis));
  return out;
}

std::vector<size_t> sizes_of(FrameSource& frames) {
  std::vector<size_t> out;
  while (const auto frame = frames.next()) out.push_back(frame->points.size());
  return out;
}

std::string all_remarks(const FrameSource& frames) {
  std::string out;
  for (const std::string& remark : frames.remarks()) out += remark + "\n";
  return out;
}

// ---- bare numbers ------------------------------------------------------------------------------

std::string raw_points(int columns, float beside) {
  std::string out;
  for (int i = 0; i < 80; ++i)
    for (int k = 0; k < columns; ++k) out += raw(k < 3 ? coordinate_of(0, i, k) - 1 : beside);
  return out;
}

TEST_F(ReadersSensors, PointsOfALidarAsBareNumbers) {
  for (const int columns : {4, 5}) {
    const std::string file = dir.write("000.bin", raw_points(columns, 0.3f));
    ASSERT_TRUE(is_cloud_by_content(file)) << columns;
    const Mesh mesh = read_mesh(file);
    ASSERT_EQ(mesh.vertices.size(), 80u);
    EXPECT_EQ(mesh.vertices[7].z(), coordinate_of(0, 7, 2) - 1);
  }
  std::string whole;
  for (int i = 0; i < 320; ++i) whole += raw(int32_t{i});
  for (const std::string& other : {raw_points(4, -0.3f), raw_points(3, 0) + "abc", whole,
                                   raw_points(4, NAN), std::string(640, '\0')}) {
    const std::string file = dir.write("other.bin", other);
    EXPECT_FALSE(is_cloud_by_content(file));
    EXPECT_HAS(error_of([&] { read_mesh(file); }), "numpy.fromfile");
  }
}

// ---- tables ------------------------------------------------------------------------------------

TEST_F(ReadersSensors, FirstColumnsThatNumberPointsAreLeftOut) {
  const Points two = {{0.5f, 1.5f, 2.5f}, {0.25f, 1.25f, 2.25f}};
  const std::string colmap =
      "# 3D point list\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, "
      "POINT2D_IDX)\n1 0.5 1.5 2.5 213 66 27 0.8 1 268 2 406\n9 0.25 1.25 2.25 1 2 3 0.7 1 4\n";
  EXPECT_EQ(read_mesh(dir.write("points3D.txt", colmap)).vertices, two);
  std::string ids;
  for (int i = 0; i < 8; ++i)
    ids += cat(3 * i + 1, ",", i % 2 ? "0.25,1.25,2.25" : "0.5,1.5,2.5", ",", 30 * i, ",0.7\n");
  const Points read = read_mesh(dir.write("ids.csv", ids)).vertices;
  ASSERT_EQ(read.size(), 8u);
  EXPECT_EQ(read[0], two[0]);
  EXPECT_EQ(read[1], two[1]);
}

std::string recording(const std::string& head, int frames, int points, double step, int packet) {
  std::string out = head + "\n";
  for (int i = 0; i < frames * points; ++i)
    out += format("%.0f,%g,%g,%g\n", 1e9 + step * (i / packet), double{coordinate_of(0, i, 0)},
                  double{coordinate_of(0, i, 1)}, double{coordinate_of(0, i, 2)});
  return out;
}

TEST_F(ReadersSensors, TablesOfAWholeRecordingAreParted) {
  const auto scans =
      open_frames(dir.write("a.csv", recording("Timestamp,X,Y,Z", 5, 100, 5e7, 100)));
  EXPECT_EQ(sizes_of(*scans), std::vector<size_t>(5, 100));
  EXPECT_DOUBLE_EQ(scans->fps(), 20);
  const auto numbered = open_frames(dir.write("b.csv", recording("frame,x,y,z", 3, 70, 1, 70)));
  EXPECT_EQ(sizes_of(*numbered), std::vector<size_t>(3, 70));
  EXPECT_DOUBLE_EQ(numbered->fps(), kFps);
  EXPECT_HAS(all_remarks(*numbered), "'frame' parts it into 3 frames");
  // 10 points each millisecond, in nanoseconds: a tenth of a second is a frame.
  const auto packets = open_frames(dir.write("c.csv", recording("time,x,y,z", 4, 1000, 1e6, 10)));
  EXPECT_EQ(sizes_of(*packets), std::vector<size_t>(4, 1000));
  EXPECT_DOUBLE_EQ(packets->fps(), 10);
  // A Velodyne's turn: one cloud, and its columns are named in two ways.
  std::string turn = "Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2,X,Y,Z,time_us\n";
  for (int i = 0; i < 400; ++i) turn += cat("9,9,9,1,", i, ",3,", 7000 + 46 * (i / 8), "\n");
  const Points points = read_mesh(dir.write("turn.csv", turn)).vertices;
  ASSERT_EQ(points.size(), 400u);
  EXPECT_EQ(points[5], Point(1, 5, 3));
  EXPECT_HAS(error_of([&] {
               open_frames(dir.write("d.csv", recording("frame,x,y,z", 3, 20, 1, 20)))->next();
             }),
             "another frame begins here");
}

// ---- PLY ---------------------------------------------------------------------------------------

TEST_F(ReadersSensors, StripsOfTrianglesKeepThem) {
  const std::string file =
      dir.write("strips.ply",
                "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
                "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n"
                "11 0 1 2 3 3 -1 2 3 4 -1 5\n");
  const std::vector<Triangle> faces = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
  EXPECT_EQ(read_mesh(file).faces, faces);
  EXPECT_HAS(error_of([&] {
               read_mesh(dir.write(
                   "bad.ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                   "end_header\n0 0 0\n3 0 1 2\n"));
             }),
             "out of range");
}

std::string splats(int seen, int faint) {
  std::string out = cat("ply\nformat ascii 1.0\nelement vertex ", seen + faint,
                        "\nproperty float x\nproperty float y\nproperty float z\nproperty float "
                        "f_dc_0\nproperty float opacity\nend_header\n");
  for (int i = 0; i < seen + faint; ++i) out += cat(i, " 1 2 0.1 ", i < seen ? 1.5 : -5.0, "\n");
  return out;
}

TEST_F(ReadersSensors, SplatsThatNobodySeesAreLeftOut) {
  LeftOut left_out;
  EXPECT_EQ(read_frame_mesh(dir.write("a.ply", splats(70, 30)), left_out).vertices.size(), 70u);
  EXPECT_EQ(left_out.faint, 30u);
  EXPECT_EQ(read_frame_mesh(dir.write("a.ply", splats(60, 30)), left_out).vertices.size(), 90u);
  EXPECT_EQ(left_out.faint, 0u);
  EXPECT_EQ(read_mesh(dir.write("a.ply", splats(70, 30))).vertices.size(), 100u);  // targets
  const auto frames = open_frames(dir.write("a.ply", splats(70, 30)));
  EXPECT_EQ(sizes_of(*frames), std::vector<size_t>{70});
  EXPECT_HAS(all_remarks(*frames), "left out 30 splats of an opacity below a tenth");
}

TEST_F(ReadersSensors, PackedSplatsAreUnpacked) {
  std::string head = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
  for (const char* name : {"min_x", "min_y", "min_z", "max_x", "max_y", "max_z"})
    head += cat("property float ", name, "\n");
  head +=
      "element vertex 2\nproperty uint packed_position\nproperty uint packed_color\nend_header\n";
  std::string body;
  for (const float x : {-1.f, 0.f, 2.f, 1.f, 2.f, 4.f}) body += raw(x);
  body += raw(uint32_t{0}) + raw(uint32_t{0xFF});
  body += raw(uint32_t{0xFFFFFFFF}) + raw(uint32_t{0xFF});
  const Points expected = {{-1, 0, 2}, {1, 2, 4}};
  EXPECT_EQ(read_mesh(dir.write("a.ply", head + body)).vertices, expected);
  std::string none = head;
  none.replace(none.find("chunk 1"), 7, "chunk 0");
  EXPECT_HAS(error_of([&] { read_mesh(dir.write("b.ply", none + body.substr(24))); }),
             "fewer chunks");
}

// ---- windows and padding -----------------------------------------------------------------------

TEST_F(ReadersSensors, WindowsAreSequences) {
  EXPECT_EQ(cloud_axes({2, 16, 70, 3})->sequences, 2);
  EXPECT_EQ(cloud_axes({2, 16, 70, 3})->frames, 32);
  EXPECT_EQ(cloud_axes({2, 16, 70, 3})->points, 70);
  EXPECT_EQ(cloud_axes({5, 288, 320, 3})->sequences, 1);
  EXPECT_EQ(cloud_axes({2, 4, 100, 6})->columns, 6);
  const std::string array = npy<float>({2, 3, 70, 3}, cloud_of(6, 70));
  const std::string counts = npy<int64_t>({2, 3}, {70, 69, 68, 67, 66, 65});
  const std::vector<size_t> sizes = {70, 69, 68, 67, 66, 65};
  {
    h5::File file = h5::File::create(dir / "w.h5");
    file.write<float>("/point_clouds", {2, 3, 70, 3}, cloud_of(6, 70));
    file.write<int64_t>("/points_num", {2, 3}, {70, 69, 68, 67, 66, 65});
    file.write<float>("/shape", {2, 3, 10}, std::vector<float>(60, 0.5f));
    file.write<float>("/trans", {2, 3, 3}, std::vector<float>(18, 0.5f));
    file.commit();
  }
  const std::string npz_file =
      dir.write("w.npz", npz({{"point_clouds", array},
                              {"points_num", counts},
                              {"shape", npy<float>({2, 3, 10}, std::vector<float>(60, 0.5f))}}));
  for (const std::string& path : {dir / "w.h5", npz_file}) {
    const auto all = open_frames(path);
    EXPECT_EQ(all->sequences(), 2);
    EXPECT_EQ(all->frames(), 6);
    EXPECT_EQ(sizes_of(*all), sizes) << path;
    EXPECT_HAS(all_remarks(*all), "2 sequences of 3 frames of 70 points");
    all->rewind();
    for (int f = 0; f < 4; ++f) all->skip();
    const auto fifth = all->next();
    EXPECT_EQ(fifth->sequence, 1);
    EXPECT_EQ(fifth->points[2].y(), coordinate_of(4, 2, 1));
    FrameOptions second;
    second.sequence = 1;
    const auto one = open_frames(path, second);
    EXPECT_EQ(one->frames(), 3);
    const auto first = one->next();
    EXPECT_EQ(first->sequence, 0);
    EXPECT_EQ(first->points.size(), 67u);
    EXPECT_EQ(first->points[0].x(), coordinate_of(3, 0, 0));
    second.sequence = 2;
    EXPECT_HAS(error_of([&] { open_frames(path, second); }), "no sequence number 2");
  }
}

/// Rows of a picture that nobody knows the size of.
TEST_F(ReadersSensors, PicturesAreToldByTheirNumbers) {
  std::vector<float> out;
  for (int f = 0; f < 2; ++f)
    for (int row = 0; row < 40; ++row)
      for (int column = 0; column < 50; ++column)
        for (const float x : {0.02f * column, 0.04f * row, 2 + 0.001f * ((row + column) % 7)})
          out.push_back(x);
  const auto frames = open_frames(dir.write("p.npy", npy<float>({2, 40, 50, 3}, out)));
  EXPECT_EQ(frames->sequences(), 1);
  EXPECT_EQ(sizes_of(*frames), std::vector<size_t>(2, 2000));
  EXPECT_HAS(all_remarks(*frames), "depth camera");
}

TEST_F(ReadersSensors, FramesThatWereFilledUpAreCut) {
  std::vector<float> cloud = cloud_of(3, 100);
  const std::vector<size_t> sizes = {80, 100, 70};
  std::vector<int64_t> valid, padded;
  for (int f = 0; f < 3; ++f)
    for (int i = 0; i < 100; ++i) {
      const bool is = i < static_cast<int>(sizes[static_cast<size_t>(f)]);
      valid.push_back(is);
      padded.push_back(!is);
    }
  const std::string full = npy<float>({3, 100, 3}, cloud);
  for (size_t k = 0; k < valid.size(); ++k)
    if (!valid[k]) std::fill_n(cloud.begin() + static_cast<int64_t>(3 * k), 3, 0.0f);
  const std::string zeros = npy<float>({3, 100, 3}, cloud);
  const std::string counts = npy<int64_t>({3}, {80, 100, 70});
  const std::pair<std::string, std::string> beside[] = {
      {"lengths", counts},
      {"n_points", npy<int64_t>({3, 1}, {80, 100, 70})},
      {"num_points", npy<double>({3}, {80, 100, 70})},
      {"valid_mask", npy<int64_t>({3, 100}, valid)},
      {"padding_mask", npy<int64_t>({3, 100}, padded)}};
  for (const auto& [name, array] : beside) {
    const auto frames = open_frames(dir.write("a.npz", npz({{"points", full}, {name, array}})));
    EXPECT_EQ(sizes_of(*frames), sizes) << name;
    EXPECT_HAS(all_remarks(*frames), "left out 50 points of 2 frames: by '" + name + "'");
  }
  // Whatever a mask is called, zeros are none.
  const auto mask = open_frames(
      dir.write("a.npz", npz({{"points", zeros}, {"mask", npy<int64_t>({3, 100}, padded)}})));
  EXPECT_EQ(sizes_of(*mask), sizes);
  const auto bare = open_frames(dir.write("a.npy", zeros));
  EXPECT_EQ(sizes_of(*bare), sizes);
  EXPECT_HAS(all_remarks(*bare), "left out 50 points of 2 frames: exactly zero");
  // What is no count of points cuts nothing.
  for (const auto& array : {npy<int64_t>({3}, {80, -1, 70}), npy<int64_t>({2}, {80, 70}),
                            npy<int64_t>({3}, {200, 300, 400})})
    EXPECT_EQ(
        sizes_of(*open_frames(dir.write("b.npz", npz({{"points", full}, {"lengths", array}})))),
        std::vector<size_t>(3, 100));
}

TEST_F(ReadersSensors, LengthsOfSequencesEndThem) {
  const std::string array = npy<float>({2, 4, 70, 3}, cloud_of(8, 70));
  const auto frames = open_frames(
      dir.write("a.npz", npz({{"points", array}, {"seq_lengths", npy<int64_t>({2}, {4, 2})}})));
  EXPECT_EQ(sizes_of(*frames), (std::vector<size_t>{70, 70, 70, 70, 70, 70, 0, 0}));
}

// ---- far away ----------------------------------------------------------------------------------

TEST_F(ReadersSensors, FarAwayFramesAreReadFromAnOrigin) {
  std::vector<double> far;
  for (const float x : cloud_of(2, 80)) far.push_back(5e6 + double{x});
  const std::string path = dir.write("a.npy", npy<double>({2, 80, 3}, far));
  EXPECT_HAS(error_of([&] { open_frames(path)->next(); }), "restage doctor SOURCE --fix OUT");
  FrameOptions how;
  how.origin = far_origin(path);
  ASSERT_NEAR(how.origin.x(), 5e6, 10);
  const auto frames = open_frames(path, how);
  const auto first = frames->next();
  EXPECT_NEAR(first->points[5].x() + how.origin.x(), 5e6 + double{coordinate_of(0, 5, 0)}, 1e-6);
  const std::string near = dir.write("b.npy", npy<float>({2, 80, 3}, cloud_of(2, 80)));
  EXPECT_TRUE(far_origin(near).isZero(0));
  std::vector<float> coarse(far.begin(), far.end());
  EXPECT_HAS(error_of([&] {
               open_frames(dir.write("c.npy", npy<float>({2, 80, 3}, coarse)))->next();
             }),
             "before they are saved in single precision");
}

}  // namespace
}  // namespace restage
