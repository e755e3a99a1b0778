// Clouds of other programs: PCD files, tables of points, HDF5 files that are not laid out as ours.
#include <gtest/gtest.h>

#include <algorithm>

#include "datasets/hdf5/file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersClouds = FileTest;

// ---- PCD ---------------------------------------------------------------------------------------

std::string pcd_header(const std::string& data, int points = 3) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS intensity x y z _ "
         "rgb\nSIZE 2 4 4 8 1 "
         "4\nTYPE U F F F U U\nCOUNT 1 1 1 1 3 1\nWIDTH " +
         n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " + data + "\n";
}

const Points kPcdPoints = {{0.5f, -1, 2}, {3, 4, -5.25f}};

/// Rows of intensity, x, y, z, three bytes of nothing, colour; the last point has no answer.
std::string pcd_rows() {
  std::string out;
  for (const Vec3& p : {Vec3(0.5, -1, 2), Vec3(3, 4, -5.25), Vec3(NAN, NAN, NAN)})
    out += raw(uint16_t{7}) + raw(static_cast<float>(p.x())) + raw(static_cast<float>(p.y())) +
           raw(p.z()) + "abc" + raw(uint32_t{0xff00ff});
  return out;
}

/// Field after field, as PCL packs them.
std::string pcd_columns() {
  const std::string rows = pcd_rows();
  const size_t sizes[] = {2, 4, 4, 8, 3, 4}, row = rows.size() / 3;
  std::string out;
  for (size_t f = 0, at = 0; f < std::size(sizes); at += sizes[f++])
    for (size_t i = 0; i < 3; ++i) out += rows.substr(i * row + at, sizes[f]);
  return out;
}

/// LZF of literals, and of a copy where four bytes repeat those before.
std::string lzf(const std::string& bytes) {
  std::string out, literals;
  const auto flush = [&] {
    for (size_t at = 0; at < literals.size(); at += 32) {
      const std::string some = literals.substr(at, 32);
      out += static_cast<char>(some.size() - 1) + some;
    }
    literals.clear();
  };
  for (size_t at = 0; at < bytes.size();) {
    size_t length = 0;
    while (at >= 4 && at + length < bytes.size() && length < 264 &&
           bytes[at + length] == bytes[at + length - 4])
      ++length;
    if (length < 3) {
      literals += bytes[at++];
      continue;
    }
    flush();
    const size_t code = length - 2;
    out += static_cast<char>(std::min<size_t>(code, 7) << 5);
    if (code >= 7) out += static_cast<char>(code - 7);
    out += '\3';  // four bytes back
    at += length;
  }
  flush();
  return out;
}

TEST_F(ReadersClouds, PcdInAllEncodings) {
  const std::string columns = pcd_columns(), packed = lzf(columns);
  const std::string files[] = {
      pcd_header("ascii") + "7 0.5 -1 2 0 0 0 99\n\n7 3 4 -5.25 0 0 0 99\n7 nan nan nan 0 0 0 99\n",
      pcd_header("binary") + pcd_rows(),
      pcd_header("binary_compressed") + raw(static_cast<uint32_t>(packed.size())) +
          raw(static_cast<uint32_t>(columns.size())) + packed};
  for (const std::string& file : files) {
    size_t left_out = 0;
    EXPECT_EQ(read_frame_mesh(dir.write("a.pcd", file), left_out).vertices, kPcdPoints);
    EXPECT_EQ(left_out, 1u);
    EXPECT_EQ(read_frame_mesh(dir.write("unnamed", file), left_out).vertices, kPcdPoints);
    // At whatever byte it is cut, but for the end of its last line.
    for (size_t n = 1; n + 2 < file.size(); ++n) {
      const std::string cut = dir.write("cut.pcd", file.substr(0, n));
      EXPECT_HAS(error_of([&] { read_frame_mesh(cut, left_out); }), "cut.pcd") << n;
    }
  }
  size_t left_out = 0;
  EXPECT_TRUE(
      read_frame_mesh(dir.write("a.pcd", pcd_header("binary", 0)), left_out).vertices.empty());
}

TEST_F(ReadersClouds, BadPcdIsOneClearLine) {
  const auto refusal = [&](std::string file, const std::string& from, const std::string& to) {
    file.replace(file.find(from), from.size(), to);
    return error_of([&] { read_mesh(dir.write("a.pcd", file)); });
  };
  const std::string file =
      pcd_header("ascii") + "7 0.5 -1 2 0 0 0 99\n7 3 4 5 0 0 0 99\n7 1 1 1 0 0 0 99\n";
  EXPECT_HAS(refusal(file, " x y", " a y"), "has no field x");
  EXPECT_HAS(refusal(file, "TYPE U F F F", "TYPE U F F Q"), "field z is no single number");
  EXPECT_HAS(refusal(file, "POINTS 3", "POINTS -3"), "'-3' is no usable count");
  EXPECT_HAS(refusal(file, "POINTS 3", "POINTS 999999999999"), "no usable count");
  EXPECT_HAS(refusal(file, "POINTS 3", "POINTS 9999999"), "cut short");
  EXPECT_HAS(refusal(file, "0.5", "0,5"),
             "a.pcd:12: '0,5' is no number; write decimals with points");
  EXPECT_HAS(refusal(file, "ascii", "zip"), "has DATA 'zip'");
  // Sizes that the packed bytes cannot have.
  const std::string columns = pcd_columns(), packed = lzf(columns);
  const auto compressed = [&](uint32_t length, uint32_t size, const std::string& bytes) {
    return error_of([&] {
      read_mesh(
          dir.write("b.pcd", pcd_header("binary_compressed") + raw(length) + raw(size) + bytes));
    });
  };
  const auto n = static_cast<uint32_t>(packed.size()), m = static_cast<uint32_t>(columns.size());
  EXPECT_HAS(compressed(n + 1, m, packed), "cut short");
  EXPECT_HAS(compressed(n, m + 1, packed), "its size is not that of its points");
  EXPECT_HAS(compressed(n, m, std::string(n, '\xff')), "damaged");
  EXPECT_HAS(compressed(n, m, std::string(n, '\0')), "damaged");
}

// ---- tables ------------------------------------------------------------------------------------

TEST_F(ReadersClouds, TablesOfPoints) {
  const std::pair<const char*, const char*> files[] = {
      {"a.xyz", "1 2 3\n4 5 6\n"},
      {"a.xyz", "\xEF\xBB\xBF# made by somebody\n1.000000000000000000e+00 2e0 3\n\n4 5 6\r\n"},
      {"a.txt", "1\t2\t3\t255\t0\t0\n4\t5\t6\t0\t0\t0\n"},
      {"a.xyzrgb", "1 2 3 0.1 0.2 0.3\n4 5 6 0.1 0.2 0.3\n"},
      {"a.pts", "2\n1 2 3 -1200 10 20 30\n4 5 6 -1 1 2 3\n"},
      {"a.asc", "//X Y Z R G B\n1 2 3 9 9 9\n4 5 6 9 9 9\n"},
      {"a.csv", "x,y,z\n1,2,3\n4,5,6\n"},
      {"a.csv", "1, 2, 3\n4, 5, 6\n"},
      {"a.csv", ",\"Z [m]\",\"X [m]\",\"Y [m]\"\n0,3,1,2\n1,6,4,5\n"},
      {"a.csv", "intensity,Points:0,Points:1,Points:2\n9,1,2,3\n9,4,5,6\n"},
      {"a.csv", "x;y;z\n1,0;2,0;3,0\n4,0;5,0;6,0\n"},
      {"a.csv", "frame,x,y,z\n8,1,2,3\n8,4,5,6\n"},
      {"a.csv", "timestamp,x,y,z\n0.01,1,2,3\n0.02,4,5,6\n"},
      {"a.xyz", "1 2 3\r4 5 6\r"}};
  for (const auto& [name, text] : files)
    EXPECT_EQ(read_mesh(dir.write(name, text)).vertices, (Points{{1, 2, 3}, {4, 5, 6}})) << text;
  size_t left_out = 0;
  EXPECT_EQ(
      read_frame_mesh(dir.write("b.csv", "x,y,z\n1,2,3\n,,\nNaN,0,0\n"), left_out).vertices.size(),
      1u);
  EXPECT_EQ(left_out, 2u);
  EXPECT_TRUE(read_frame_mesh(dir.write("empty.xyz", ""), left_out).vertices.empty());
}

TEST_F(ReadersClouds, OtherTablesAreRefused) {
  const std::pair<const char*, const char*> files[] = {
      {"1 2 3\n4 5\n", "a.xyz:2: has fewer than 3 numbers"},
      {"1 2 3 4\n4 5 6\n", "a.xyz:2: has 3 columns, the lines before 4"},
      {"0,1 0,2 0,3\n", "'0,1' is no number; write decimals with points"},
      {"frame,x,y,z\n1,0,0,0\n1,1,0,0\n2,0,0,0\n", "another frame begins here"},
      {"Frame,Hips,Spine\n1,0,0\n", "'Frame' is no number"},
      {"3\n1 2 3\n4 5 6\n", "holds 2 points, its first line says 3"},
      {"0 1 2 3\n1 1 2 3\n2 1 2 4\n3 5 5 5\n", "its first column only counts"},
      {"ncols 5\nnrows 5\n", "has fewer than 3 numbers"}};
  for (const auto& [text, says] : files)
    EXPECT_HAS(error_of([&, t = text] { read_mesh(dir.write("a.xyz", t)); }), says);
  EXPECT_HAS(error_of([&] { read_mesh(dir.write("a.xyz", "\n")); }), "holds no points");
}

// ---- HDF5 --------------------------------------------------------------------------------------

std::vector<float> marked(int64_t frames, int64_t points, bool frames_last) {
  std::vector<float> out(static_cast<size_t>(frames * points * 3));
  for (int64_t f = 0; f < frames; ++f)
    for (int64_t i = 0; i < points; ++i)
      for (int64_t c = 0; c < 3; ++c)
        out[static_cast<size_t>(frames_last ? (i * 3 + c) * frames + f
                                            : (f * points + i) * 3 + c)] =
            static_cast<float>(1000 * f + i) + 0.25f * static_cast<float>(c);
  return out;
}

void expect_marked(FrameSource& source, int64_t frames, int64_t points, int64_t sequence = 0) {
  for (int64_t f = 0; f < frames; ++f) {
    const auto frame = source.next();
    ASSERT_TRUE(frame);
    ASSERT_EQ(std::ssize(frame->points), points);
    EXPECT_EQ(frame->sequence, sequence);
    const auto x = static_cast<float>(1000 * f + 5);
    EXPECT_EQ(frame->points[5], Point(x, x + 0.25f, x + 0.5f));
  }
}

TEST_F(ReadersClouds, CloudsBesideJointsAreTaken) {
  const std::vector<float> joints(size_t{4} * 22 * 3, 1);
  const auto with = [&](const char* name, const h5::Shape& shape, bool points_last) {
    h5::File file = h5::File::create(dir / "a.h5");
    file.write<float>("/joints", {4, 22, 3}, joints);
    file.write<float>("/normals_of_all", {4, 80, 3}, std::vector<float>(960, 7));
    file.write<float>(name, shape, marked(4, 80, points_last));
    file.commit();
  };
  for (const char* name : {"/pcl", "/points", "/depth/cloud", "/clouds"}) {
    with(name, {4, 80, 3}, false);
    EXPECT_TRUE(is_foreign_hdf5(dir / "a.h5")) << name;
    const auto frames = open_frames(dir / "a.h5");
    EXPECT_EQ(frames->frames(), 4) << name;
    expect_marked(*frames, 4, 80);
    EXPECT_HAS(frames->remarks().at(0), std::string("taken from '") + name);
    EXPECT_HAS(frames->remarks().at(0), "left out: '/joints'");
  }
  {  // joints alone are a prediction, joints and vertices too
    h5::File file = h5::File::create(dir / "b.h5");
    file.write<float>("/joints", {4, 22, 3}, joints);
    file.commit();
  }
  EXPECT_FALSE(is_foreign_hdf5(dir / "b.h5"));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.h5"); }), "/points: is missing");
}

TEST_F(ReadersClouds, Hdf5IsKnownByItsFirstBytesWhateverItsName) {
  {
    h5::File file = h5::File::create(dir / "a.h5");
    file.write<float>("/pcl", {4, 80, 3}, marked(4, 80, false));
    file.commit();
  }
  const std::string bytes = bytes_of(dir / "a.h5");
  // MATLAB puts 512 bytes of its own before it.
  std::string head = "MATLAB 7.3 MAT-file";
  head.resize(512, ' ');
  for (const char* name : {"b.mat", "c.data"}) {
    EXPECT_TRUE(is_hdf5(dir.write(name, bytes))) << name;
    EXPECT_EQ(open_frames(dir / name)->frames(), 4) << name;
  }
  EXPECT_TRUE(is_hdf5(dir.write("d.mat", head + bytes)));
  EXPECT_EQ(open_frames(dir / "d.mat")->frames(), 4);
  EXPECT_FALSE(is_hdf5(dir.write("e.mat", head)));
  EXPECT_FALSE(is_hdf5(dir.path()));
  EXPECT_FALSE(is_hdf5(dir / "none.mat"));
  EXPECT_HAS(error_of([&] { open_frames(dir / "e.mat"); }), "-v7.3");
}

TEST_F(ReadersClouds, Hdf5FilesOfOthers) {
  {  // as Dynamic FAUST: a set a sequence, frames last, and faces
    h5::File file = h5::File::create(dir / "dfaust.hdf5");
    file.write<float>("/50002_walk", {70, 3, 300}, marked(300, 70, true));
    file.write<float>("/50004_run", {70, 3, 2}, marked(2, 70, true));
    file.write<int64_t>("/faces", {1, 3}, {0, 1, 69});
    file.commit();
    h5::File groups = h5::File::create(dir / "groups.h5");
    for (const int f : {10, 9}) {
      const std::string name = "/frame_" + std::to_string(f);
      groups.write<double>(name + "/xyz", {80, 3}, std::vector<double>(240, f));
      groups.write<double>(name + "/normals", {80, 3}, std::vector<double>(240, 7));
    }
    groups.commit();
    h5::File plain = h5::File::create(dir / "plain.h5");
    plain.write<float>("/data", {4, 80, 3}, marked(4, 80, false));
    plain.write<int64_t>("/label", {4, 1}, {1, 2, 3, 4});
    plain.commit();
    h5::File two = h5::File::create(dir / "two.h5");
    for (const char* name : {"/a", "/b"}) two.write<float>(name, {80, 3}, marked(1, 80, false));
    two.commit();
    h5::File none = h5::File::create(dir / "none.h5");
    none.write<float>("/betas", {10}, std::vector<float>(10, 0));
    none.commit();
  }
  const auto dfaust = open_frames(dir / "dfaust.hdf5");
  EXPECT_EQ(dfaust->frames(), 302);
  EXPECT_EQ(dfaust->sequences(), 2);
  EXPECT_HAS(dfaust->remarks().at(0), "[points, xyz, frames]");
  expect_marked(*dfaust, 300, 70);
  expect_marked(*dfaust, 2, 70, 1);
  EXPECT_FALSE(dfaust->next());
  dfaust->rewind();
  expect_marked(*dfaust, 2, 70);
  FrameOptions second;
  second.sequence = 1;
  const auto run = open_frames(dir / "dfaust.hdf5", second);
  EXPECT_EQ(run->frames(), 2);
  run->skip();
  EXPECT_EQ(run->next()->points[0].x(), 1000);
  const auto groups = open_frames(dir / "groups.h5");
  EXPECT_EQ(groups->frames(), 2);
  EXPECT_EQ(groups->next()->points[0].x(), 9);
  EXPECT_EQ(groups->next()->points[0].x(), 10);
  expect_marked(*open_frames(dir / "plain.h5"), 4, 80);
  EXPECT_HAS(error_of([&] { open_frames(dir / "two.h5"); }),
             "several arrays of points: '/a', '/b'");
  EXPECT_HAS(error_of([&] { open_frames(dir / "none.h5"); }), "/points: is missing");
  second.sequence = 2;
  EXPECT_HAS(error_of([&] { open_frames(dir / "dfaust.hdf5", second); }), "no sequence number 2");
}

}  // namespace
}  // namespace restage
