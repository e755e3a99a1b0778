// PLY, OBJ and sequences of frames: every encoding, and one clear line for every bad file.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/text/text.h"
#include "datasets/schema.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using Readers = FileTest;

Mesh square() {
  Mesh mesh;
  mesh.vertices = {{0, 0.1f, 0}, {1, 0, -2.5e-7f}, {1, 1, 1e20f}, {0, 1, 1.f / 3}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

void expect_equal(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.faces, b.faces);
}

TEST_F(Readers, WritesAndReadsPlyAndObjBitForBit) {
  write_ply(dir / "a.ply", square());
  write_obj(dir / "a.obj", square());
  expect_equal(read_mesh(dir / "a.ply"), square());
  expect_equal(read_mesh(dir / "a.obj"), square());
  Mesh cloud = square();
  cloud.faces.clear();
  write_ply(dir / "c.PLY", cloud);
  expect_equal(read_mesh(dir / "c.PLY"), cloud);
  std::filesystem::rename(dir / "a.ply", dir / "no_extension");
  std::filesystem::rename(dir / "a.obj", dir / "b.txt");
  expect_equal(read_mesh(dir / "no_extension"), square());
  expect_equal(read_mesh(dir / "b.txt"), square());
}

TEST_F(Readers, ReadsPlyOfAnyOrderTypeAndEncoding) {
  const std::string header =
      " 1.0\r\ncomment made by hand\r\nobj_info x\r\nelement material 2\r\nproperty list uchar "
      "short ids\r\n"
      "element vertex 5\r\nproperty double z\r\nproperty uchar red\r\nproperty short x\r\nproperty "
      "float32 y\r\n"
      "element face 2\r\nproperty float quality\r\nproperty list ushort uint vertex_index\r\n"
      "property list int8 float32 texcoord\r\nend_header\r\n";
  const std::string ascii =
      "2 7 -8\r\n0\r\n0 255 0 0\r\n0 1 1 0\r\n\r\n0 2 1 1\r\n+0.5 3 0 1e0\r\n1 4 -1 .5\r\n"
      "0.5 3 0 1 2 1 0.25\r\n1 5 0 1 2 3 4 0\r\n";
  write_bytes(dir / "a.ply", "ply\r\nformat ascii" + header + ascii);
  Mesh expected;
  expected.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5f}, {-1, 0.5f, 1}};
  expected.faces = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  expect_equal(read_mesh(dir / "a.ply"), expected);

  for (const bool big : {false, true}) {
    const auto one = [&](auto value) {
      const std::string bytes = raw(value);
      return big ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
    };
    const auto all = [&](auto... values) { return (one(values) + ...); };
    std::string bytes = all(uint8_t{2}, int16_t{7}, int16_t{-8}, uint8_t{0});
    for (const Point& p : expected.vertices)
      bytes += all(double{p[2]}, uint8_t{200}, static_cast<int16_t>(p[0]), p[1]);
    bytes += all(0.5f, uint16_t{3}, 0u, 1u, 2u, int8_t{1}, 0.25f);
    bytes += all(1.0f, uint16_t{5}, 0u, 1u, 2u, 3u, 4u, int8_t{0});
    const std::string format = big ? "binary_big_endian" : "binary_little_endian";
    expect_equal(read_mesh(dir.write("b.ply", "ply\r\nformat " + format + header + bytes)),
                 expected);
    write_bytes(dir / "b.ply",
                "ply\r\nformat " + format + header + bytes.substr(0, bytes.size() - 1));
    EXPECT_HAS(error_of([&] { read_mesh(dir / "b.ply"); }), "b.ply: is cut short");
  }
}

TEST_F(Readers, ReadsObjOfAllFlavours) {
  write_bytes(
      dir / "a.obj",
      "# comment\nmtllib x.mtl\r\no thing\nv 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\n  v 1 1 0\nvt 0 0\n"
      "vn 0 0 1\nf 1/1/1 2/1/1 3/1/1\ns off\nv 0 1 0\nf -4//1 -3//1 -2//1 -1//1 # four\nf 1/1 3/1 "
      "4/1\nl 1 2");
  Mesh expected;
  expected.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  expected.faces = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {0, 2, 3}};
  expect_equal(read_mesh(dir / "a.obj"), expected);
}

/// A file's content and what is said of it, from its name on.
struct BadFile {
  std::string content, says;
};

std::string ply(const std::string& elements, const std::string& rows) {
  return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + rows;
}

const std::string kVertex3 =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFace1 = "element face 1\nproperty list uchar int vertex_indices\n";

std::vector<BadFile> bad_files() {
  const std::string three = "0 0 0\n1 0 0\n0 1 0\n";
  std::string binary =
      "ply\nformat binary_little_endian 1.0\n" + kVertex3 + "end_header\n" + std::string(36, '\0');
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(&binary[binary.size() - 8], &nan, 4);
  return {
      {"", "empty.ply: is empty and holds no points"},
      {"hello", "text.ply: is not a PLY file"},
      {"hello", "text.bin: is neither PLY, OBJ, glTF nor a cloud (PCD, XYZ)"},
      {"hello", "text.fbx: is no FBX file; export it again, or export GLB (glTF) from Blender"},
      {"hello", "walk.bvh: is a recording of a skeleton, not clouds; restage data import"},
      {"ply\nformat ascii 1.0\nelement vertex 3\n",
       "header.ply: is cut short inside the PLY header"},
      {"ply\nend_header\n", "noformat.ply:2: the PLY header names no format"},
      {"ply\nformat binary_middle_endian 1.0\n", "format.ply:2: unknown PLY format"},
      {ply("element vertex 1\nproperty real x\n", ""), "type.ply:4: unknown property type 'real'"},
      {ply("element vertex -3\n", ""), "count.ply:3: impossible count '-3' of element 'vertex'"},
      {"ply\nvertices 3\n", "word.ply:2: unknown PLY header line 'vertices'"},
      {ply("element vertex 9000000000000000000\nproperty float x\nproperty float y\nproperty float "
           "z\n",
           three),
       "huge.ply: is cut short: element 'vertex' should have 9000000000000000000 rows"},
      {ply("element junk 9000000000000000000\n" + kVertex3, three),
       "bare.ply: element 'junk' has no prop"},
      {ply("element vertex 1\nproperty float x\nproperty float y\n", "0 0\n"),
       "noz.ply: the vertices do not"},
      {ply(kVertex3, "0.25 0.25 0.25\n1 0 0\n"), "rows.ply: is cut short"},
      {ply(kVertex3, "0 0.25 0\n1 0\n0 1 0\n"), "fewer.ply:9: has fewer values"},
      {ply(kVertex3, "0 0 0 0\n1 0 0\n0 1 0\n"), "more.ply:8: has more values"},
      {ply(kVertex3, "0 0 zero\n1 0 0\n0 1 0\n"), "word2.ply:8: 'zero' is no number"},
      {ply(kVertex3, "0 0 0\n1 nan 0\n0 1 0\n"), "nan.ply:9: a coordinate is NaN"},
      {ply(kVertex3, "0 0 0\n1 -inf 0\n0 1 0\n"), "inf.ply:9: a coordinate is infinite"},
      {ply(kVertex3, "0 0 0\n1 1e39 0\n0 1 0\n"), "far.ply:9: a coordinate is infinite"},
      {binary, "binary.ply:vertex 2: a coordinate is NaN"},
      {ply("element vertex 0\nproperty float x\nproperty float y\nproperty float z\n", ""),
       "none.ply: holds no points"},
      {ply(kVertex3 + kFace1, three + "3 0 1 3\n"),
       "range.ply: triangle 0 has vertex index 3 (from 0), out of range for 3 vertices"},
      {ply(kVertex3 + kFace1, three + "3 0 1 -1\n"), "minus.ply:13: a face index is out of range"},
      {ply(kVertex3 + kFace1, three + "250 0 1 2\n"), "list.ply: is cut short"},
      {ply(kVertex3 + kFace1, three + "-3 0 1 2\n"),
       "list2.ply:13: a list has an impossible length"},
      {"# nothing\n", "none.obj: holds no points"},
      {"v 0 0 0\nv 1 0", "cut.obj:2: a vertex has fewer than 3 coordinates"},
      {"v 0 0 0\nv 1 0 1,5\n", "word.obj:2: '1,5' is no number; write decimals with points"},
      {"v 0 0 NaN\n", "nan.obj:1: a coordinate is NaN"},
      {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "range.obj: triangle 0 has vertex index 3 (from 0)"},
      {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "zero.obj:4: face index 0 is out of range"},
      {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "minus.obj:4: face index -4 is out of range"},
      {"v 0 0 0\nf 1 1 99999999999999999999\n",
       "corner.obj:2: '99999999999999999999' is no face corner"},
  };
}

TEST_F(Readers, EveryBadFileIsOneClearLine) {
  for (const auto& [content, says] : bad_files()) {
    const std::string path = dir.write(says.substr(0, says.find(':')), content);
    const std::string text = error_of([&] { read_mesh(path); });
    EXPECT_EQ(text.rfind(dir / says, 0), 0u) << text << "\nshould begin " << dir / says;
  }
  EXPECT_HAS(error_of([&] { read_mesh(dir / "absent.ply"); }), "absent.ply: cannot be read");
  EXPECT_HAS(error_of([&] { read_mesh(dir.path()); }), "is a folder");
}

TEST_F(Readers, NumbersInNamesCompareAsNumbers) {
  for (const auto& [less, more] : {std::pair{"f2.ply", "f10.ply"},
                                   {"f002.ply", "f10.ply"},
                                   {"a9b2", "a9b11"},
                                   {"a", "a1"},
                                   {"99999999999999999999998", "99999999999999999999999"}})
    EXPECT_TRUE(natural_less(less, more)) << less;
  EXPECT_FALSE(natural_less("f10.ply", "f2.ply"));
  EXPECT_TRUE(natural_less("f01", "f1") != natural_less("f1", "f01"));
  EXPECT_FALSE(natural_less("f1", "f1"));
}

TEST_F(Readers, FoldersGiveFramesInOrderWithChangingCounts) {
  const char* names[] = {"f10.ply", "f2.obj", "f1.ply", "f9.PLY"};
  for (size_t i = 0; i < 4; ++i) {
    Mesh mesh;
    mesh.vertices.assign(i + 1, Point(static_cast<float>(i), 0, 0));
    if (i == 1)
      write_obj(dir / names[i], mesh);
    else
      write_ply(dir / names[i], mesh);
  }
  write_bytes(dir / "readme.txt", "not a frame");
  write_bytes(dir / ".f3.ply", "hidden");
  const std::unique_ptr<FrameSource> frames = open_frames(dir.path());
  EXPECT_EQ(frames->frames(), 4);
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<size_t> counts;
    while (const std::optional<Frame> frame = frames->next())
      counts.push_back(frame->points.size());
    EXPECT_EQ(counts, (std::vector<size_t>{3, 2, 4, 1}));
    EXPECT_FALSE(frames->next());
    frames->rewind();
  }
  EXPECT_EQ(frames->next()->source, dir / "f1.ply");
  const std::unique_ptr<FrameSource> single = open_frames(dir / "f10.ply");
  EXPECT_EQ(single->next()->points.size(), 1u);
  EXPECT_FALSE(single->next());
}

TEST_F(Readers, Hdf5ScansAndPredictionsAreFramesToo) {
  {
    ScanWriter writer(dir / "s.h5", {}, 60);
    writer.append({{1, 0, 0}, {2, 0, 0}});
    writer.append({{3, 0, 0}});
    writer.end_sequence();
    writer.append({{4, 0, 0}, {5, 0, 0}, {6, 0, 0}});
    writer.commit();
    PredictionWriter prediction(dir / "p.h5", 3, {{0, 1, 2}}, {});
    for (int f = 0; f < 3; ++f)
      prediction.append(Joints{}, Points(3, Point(static_cast<float>(f), 1, 2)));
    prediction.commit();
  }
  const std::unique_ptr<FrameSource> scans = open_frames(dir / "s.h5");
  EXPECT_EQ(scans->frames(), 3);
  EXPECT_EQ(scans->fps(), 60);
  EXPECT_EQ(scans->next()->points.size(), 2u);
  const std::optional<Frame> second = scans->next();
  EXPECT_EQ(second->points, (Points{{3, 0, 0}}));
  EXPECT_EQ(second->source, dir / "s.h5:1");
  EXPECT_EQ(second->sequence, 0);
  const std::optional<Frame> third = scans->next();
  EXPECT_EQ(third->points.back(), Point(6, 0, 0));
  EXPECT_EQ(third->sequence, 1);
  EXPECT_FALSE(scans->next());
  scans->rewind();
  EXPECT_EQ(scans->next()->points[0], Point(1, 0, 0));
  const std::unique_ptr<FrameSource> prediction = open_frames(dir / "p.h5");
  prediction->next();
  const std::optional<Frame> posed = prediction->next();
  EXPECT_EQ(posed->points, Points(3, Point(1, 1, 2)));
  EXPECT_EQ(posed->faces, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST_F(Readers, BadSequencesAreOneClearLine) {
  EXPECT_HAS(error_of([&] { open_frames(dir.path()); }), "holds no PLY, OBJ or glTF files");
  EXPECT_HAS(error_of([&] { open_frames(dir / "absent"); }), "does not exist");
  EXPECT_HAS(error_of([&] { open_frames(dir / "absent.h5"); }), "cannot be read");
  {
    PredictionWriter joints_only(dir / "j.h5", 0, {}, {});
    joints_only.append(Joints{}, {});
    joints_only.commit();
    ScanWriter gap(dir / "gap.h5", {});
    gap.append({{1, 1, 1}});
    gap.append({});
    gap.append({Point(0, std::numeric_limits<float>::quiet_NaN(), 0)});
    gap.commit();
  }
  EXPECT_HAS(error_of([&] { open_frames(dir / "j.h5"); }),
             "/points: is missing, and so is /vertices");
  // A frame that shows nothing is a frame; points that are NaN are left out and counted.
  const std::unique_ptr<FrameSource> gap = open_frames(dir / "gap.h5");
  EXPECT_EQ(gap->next()->left_out, 0u);
  EXPECT_TRUE(gap->next()->points.empty());
  const std::optional<Frame> nan = gap->next();
  EXPECT_TRUE(nan->points.empty());
  EXPECT_EQ(nan->left_out, 1u);
  const auto seen = without_empty_frames(open_frames(dir / "gap.h5"));
  EXPECT_EQ(seen->next()->missing, 0);
  EXPECT_FALSE(seen->next());
}

TEST_F(Readers, PointsAndLinesMakeNoTriangles) {
  write_bytes(dir / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1\nl 1 2\nf 1\nf 1 2\nf 1 2 3\n");
  expect_equal(read_mesh(dir / "a.obj"), {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  const std::string text =
      "ply \r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty list uchar int of\r\nproperty "
      "double "
      "X\r\nproperty double Y\r\nproperty double Z\r\nproperty ushort red\r\nproperty uint64 "
      "t\r\nelement "
      "face 3\r\nproperty list uchar int vertex_indices\r\nend_header\r\n2 7 7 0 0 0 65535 1\r\n0 "
      "1 0 0 0 2\r\n1 "
      "5 0 1 0 0 3\r\n1 0\r\n2 0 1\r\n3 0 1 2\r\n";
  write_bytes(dir / "a.ply", text);
  expect_equal(read_mesh(dir / "a.ply"), {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
}

/// As C, Python, Java, and programs of older Windows write them; and numbers that no double holds.
TEST_F(Readers, NotANumberInAllSpellings) {
  for (const char* word :
       {"nan",     "NaN",       "-nan",     "NAN",     "nan(ind)", "-nan(ind)", "nan(snan)",
        "inf",     "-inf",      "Infinity", "-INF",    "+inf",     "1.#QNAN",   "1.#QNAN0",
        "-1.#IND", "-1.#IND00", "1.#INF",   "-1.#INF", "1.#J",     "1.#R",      "1e999"}) {
    size_t left_out = 0;
    const std::string rest = std::string(" 0 0\n1 2 3\n");
    write_bytes(dir / "a.ply",
                "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty "
                "float y\nproperty float z\nend_header\n" +
                    std::string(word) + rest);
    write_bytes(dir / "a.obj", "v " + std::string(word) + " 0 0\nv 1 2 3\n");
    write_bytes(dir / "a.xyz", word + rest);
    for (const char* name : {"a.ply", "a.obj", "a.xyz"}) {
      const Mesh mesh = read_frame_mesh(dir / name, left_out);
      EXPECT_EQ(mesh.vertices, (Points{{1, 2, 3}})) << name << " " << word;
      EXPECT_EQ(left_out, 1u) << name << " " << word;
      EXPECT_HAS(error_of([&] { read_mesh(dir / name); }), "restage doctor FILE --fix");
    }
  }
  double value = 1;
  EXPECT_TRUE(text::parse("-1e-400", value));
  EXPECT_EQ(value, 0);
  for (const char* word : {"", "-", "1.5.5", "nanx", "1#", "0x10", "1e", "n"})
    EXPECT_FALSE(text::parse(word, value)) << word;
}

}  // namespace
}  // namespace restage
