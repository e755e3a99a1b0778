// NPY and NPZ: every number, order and packing that numpy writes; one clear line for what is
// damaged, hostile or not read on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "datasets/readers/array_frames.h"
#include "datasets/readers/npz.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersArrays = FileTest;

using Arrays = std::vector<std::pair<std::string, std::string>>;

NpyArray array_of(const std::string& bytes, uint64_t limit = kMaxMemory) {
  const TempDir dir;
  return read_npy(dir.write("a.npy", bytes), limit);
}

std::string refusal(const std::string& bytes) {
  return error_of([&] { array_of(bytes); });
}

std::string zeros(size_t n) { return std::string(n, '\0'); }

// ---- NPY ---------------------------------------------------------------------------------------

template <class T>
void expect_numbers(const std::string& type, const std::vector<T>& values) {
  for (const bool big : {false, true}) {
    std::string bytes;
    for (const T value : values) {
      std::string one = raw(value);
      if (big) std::reverse(one.begin(), one.end());
      bytes += one;
    }
    const std::string order = sizeof(T) == 1 ? "|" : big ? ">" : "<";
    const NpyArray array =
        array_of(npy_as(order + type, {static_cast<int64_t>(values.size())}, bytes));
    ASSERT_EQ(array.size(), static_cast<int64_t>(values.size()));
    for (size_t i = 0; i < values.size(); ++i)
      EXPECT_EQ(array[static_cast<int64_t>(i)], static_cast<double>(values[i])) << type << big;
  }
}

TEST_F(ReadersArrays, AllNumbersInBothByteOrders) {
  expect_numbers<uint8_t>("b1", {0, 1});
  expect_numbers<int8_t>("i1", {0, -128, 127});
  expect_numbers<uint8_t>("u1", {0, 255});
  expect_numbers<int16_t>("i2", {-32768, 258});
  expect_numbers<uint16_t>("u2", {65535, 258});
  expect_numbers<int32_t>("i4", {-2147483647, 66051});
  expect_numbers<uint32_t>("u4", {4294967295u, 66051});
  expect_numbers<int64_t>("i8", {-1, int64_t{1} << 40});
  expect_numbers<uint64_t>("u8", {1, uint64_t{1} << 63});
  expect_numbers<float>("f4", {-0.1f, 1e-40f, 3e38f});
  expect_numbers<double>("f8", {-0.1, 1e-310, 1e300});
}

TEST_F(ReadersArrays, HalfPrecision) {
  const std::pair<uint16_t, double> cases[] = {
      {0x0000, 0.0},     {0x3c00, 1.0},     {0xc000, -2.0},      {0x3555, 0.333251953125},
      {0x7bff, 65504.0}, {0x0001, 0x1p-24}, {0x03ff, 0x3ffp-24}, {0x0400, 0x1p-14}};
  std::string little, big;
  for (const auto& [bits, value] : cases) {
    little += raw(bits);
    big += raw(static_cast<uint16_t>(bits << 8 | bits >> 8));
  }
  const NpyArray a = array_of(npy_as("<f2", {8}, little));
  const NpyArray b = array_of(npy_as(">f2", {8}, big));
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(a[i], cases[i].second);
    EXPECT_EQ(b[i], cases[i].second);
  }
  const NpyArray c = array_of(npy_as("<f2", {2}, raw(uint32_t{0x7e00fc00})));
  EXPECT_EQ(c[0], -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(c[1]));
  EXPECT_HAS(error_of([&] { c.finite(); }), "infinity at element 0");
}

TEST_F(ReadersArrays, OrdersVersionsAndScalars) {
  // [2, 3, 2] holding 0..11 in C order.
  std::vector<double> c(12), f(12);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 2; ++k) {
        const double value = 6 * i + 2 * j + k;
        c[static_cast<size_t>(6 * i + 2 * j + k)] = value;
        f[static_cast<size_t>(i + 2 * j + 6 * k)] = value;
      }
  for (const int version : {1, 2, 3})
    for (const bool fortran : {false, true}) {
      std::string bytes;
      for (const double value : fortran ? f : c) bytes += raw(value);
      const NpyArray array =
          array_of(npy_of(npy_header("<f8", {2, 3, 2}, fortran), bytes, version));
      EXPECT_EQ(array.shape(), (std::vector<int64_t>{2, 3, 2}));
      EXPECT_EQ(array.finite(), c);
    }
  const NpyArray scalar = array_of(npy<double>({}, {120.0}));
  EXPECT_TRUE(scalar.shape().empty());
  EXPECT_EQ(scalar.finite(), std::vector<double>{120.0});
  EXPECT_EQ(array_of(npy<float>({0, 3}, {})).size(), 0);
  // As Python 2 and hand-made headers look.
  EXPECT_EQ(array_of(npy_of("{\"shape\":(1L,),'descr':'<i8' , 'fortran_order':False}",
                            raw(int64_t{7})))[0],
            7);
}

TEST_F(ReadersArrays, Text) {
  EXPECT_EQ(array_of(npy_text("female")).text(), "female");
  EXPECT_EQ(array_of(npy_as("|S8", {}, std::string("male\0\0\0\0", 8))).text(), "male");
  const std::string big = std::string("\0\0\0\xe9\0\0\x20\xac\0\1\xf6\0", 12);
  EXPECT_EQ(array_of(npy_as(">U3", {1}, big)).text(), "é€😀");
  EXPECT_EQ(array_of(npy_as("<U0", {}, "")).text(), "");
  EXPECT_EQ(array_of(npy_as("<U2", {0}, "")).text(), "");
}

TEST_F(ReadersArrays, WhatIsNotRead) {
  const std::string plain = "{'descr': '<f8', 'fortran_order': False, 'shape': ";
  const std::pair<std::string, const char*> cases[] = {
      {npy_as("|O", {}, "\x80\x03X"), "pickle"},
      {npy_as("<f16", {1}, zeros(16)), "'<f16'"},
      {npy_as("<c8", {1}, zeros(8)), "'<c8'"},
      {npy_as("<M8[ns]", {1}, zeros(8)), "header"},
      {npy_of("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (), }", zeros(4)),
       "records"},
      {"no array", "is no NPY array"},
      {"", "is no NPY array"},
      {npy_as("<f8", {1}, zeros(8), 4), "version"}};
  for (const auto& [bytes, says] : cases) EXPECT_HAS(refusal(bytes), says);
  for (const std::string& header :
       {std::string(), std::string("{}"), std::string("{'descr': '<f8'}"),
        std::string("{'descr': '<f8', 'descr': '<f8', 'shape': ()}"),
        std::string("{'descr': '<f8', 'fortran_order': Maybe, 'shape': ()}"), plain + "(-1,)}",
        plain + "(1}", plain + "(99999999999999999999,)}", plain + "(), 'x': ()}",
        std::string("{'descr': '', 'fortran_order': False, 'shape': ()}"),
        std::string("{'descr': '<', 'fortran_order': False, 'shape': ()}"), plain + "()} more"})
    EXPECT_HAS(refusal(npy_of(header, zeros(8))), "a.npy: ") << header;
}

TEST_F(ReadersArrays, LengthsAreNeverBelieved) {
  std::string endless = npy<double>({1}, {1.0});
  endless[8] = endless[9] = '\xff';  // a header longer than the file
  const std::pair<std::string, const char*> cases[] = {
      {npy_as("<f8", {2}, zeros(15)), "cut short"},
      {npy_as("<f8", {2}, zeros(17)), "save one array a file"},
      {npy_as("<f8", {1 << 20, 1 << 20, 1 << 20}, ""), "impossible shape"},
      {npy_as("<f8", {int64_t{1} << 43}, "12345678"), "should hold"},
      {endless, "cut short"}};
  for (const auto& [bytes, says] : cases) EXPECT_HAS(refusal(bytes), says);
  EXPECT_HAS(error_of([&] { array_of(npy<double>({4}, {1, 2, 3, 4}), 31); }), "--max-memory");
}

// ---- NPZ ---------------------------------------------------------------------------------------

std::string counting(int n) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(i);
  return npy<double>({n}, values);
}

TEST_F(ReadersArrays, EveryPackingOfZip) {
  for (int variant = 0; variant < 8; ++variant) {
    std::vector<ZipEntry> entries = {
        {"x.npy", counting(1000)}, {"readme.txt", "hello"}, {"folder/y.npy", counting(3)}};
    for (ZipEntry& e : entries) {
      e.deflate = (variant & 1) != 0;
      e.zip64 = (variant & 2) != 0;
      e.descriptor = (variant & 4) != 0;
    }
    write_bytes(dir / "a.npz", zip_of(entries, variant % 3 ? "PK\5\6 a comment" : ""));
    const Npz file(dir / "a.npz");
    EXPECT_EQ(file.names(), (Names{"x", "folder/y"}));
    EXPECT_TRUE(file.has("x"));
    EXPECT_FALSE(file.has("readme"));
    const NpyArray x = file.array("x");
    ASSERT_EQ(x.size(), 1000);
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(x[i], i);
    EXPECT_EQ(file.array("folder/y").finite(), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(file.header("x").shape, std::vector<int64_t>{1000});
    EXPECT_HAS(error_of([&] { file.array("z"); }), "has no array 'z' (it has 'x', 'folder/y')");
  }
  write_bytes(dir / "a.npz", zip_of({}));
  EXPECT_TRUE(Npz(dir / "a.npz").names().empty());
}

TEST_F(ReadersArrays, AMemberCanBeReadAgainAndSkippedInto) {
  for (const bool deflate : {false, true}) {
    std::string text;
    for (int i = 0; i < 300000; ++i) text += static_cast<char>('a' + i % 23);
    const ZipFile file(dir.write("a.zip", zip_of({{"t", text, deflate}})));
    const auto in = file.open(*file.find("t"));
    for (int round = 0; round < 2; ++round, in->rewind()) {
      in->skip(123456);
      std::string piece(1000, '\0');
      in->read(piece.data(), piece.size());
      EXPECT_EQ(piece, text.substr(123456, 1000));
      EXPECT_EQ(in->left(), text.size() - 124456);
    }
    const std::vector<char> all = in->take(text.size());
    EXPECT_EQ(std::string(all.begin(), all.end()), text);
    EXPECT_HAS(error_of([&] { in->skip(1); }), "cut short");
  }
}

/// A member that lies in the bytes of another: bombs are made so.
std::string nested_members() {
  const ZipEntry inner{.name = "b.npy", .bytes = counting(99)};
  std::string nested = zip_of({inner});
  const std::string bytes = nested.substr(0, nested.find("PK\1\2"));
  nested = zip_of({{.bytes = bytes}, inner});
  const auto put = [&](size_t at, size_t value) {
    nested.replace(at, 4, raw(static_cast<uint32_t>(value)));
  };
  const size_t begin = nested.find(bytes), end = begin + bytes.size();
  nested.erase(end, bytes.size());
  put(nested.rfind("PK\1\2") + 42, begin);  // where the second member is
  put(nested.rfind("PK\5\6") + 16, end);    // and the directory
  return nested;
}

TEST_F(ReadersArrays, ArchivesThatContradictThemselves) {
  const std::string nine = counting(9);
  const std::string whole = zip_of({{.bytes = nine}});
  const size_t offset = whole.find("PK\1\2") + 42;  // where the directory says that a member is
  const auto with = [&](std::vector<std::pair<size_t, char>> changes) {
    std::string out = whole;
    for (const auto& [at, byte] : changes) out[at] = byte;
    return out;
  };
  const std::pair<std::string, const char*> cases[] = {
      {"no archive at all", "is no zip archive"},
      {"", "is no zip archive"},
      {zip_of({{.bytes = "1"}, {.bytes = "2"}}), "two members"},
      // The quine and bomb of overlapping members.
      {zip_of({{.bytes = nine}, {.name = "b.npy", .bytes = nine, .same_place = true}}),
       "contradicts the directory"},
      {zip_of({{.bytes = nine, .deflate = true, .zip64 = true, .claimed_size = uint64_t{1} << 40}}),
       "which cannot be"},
      {zip_of({{.bytes = nine, .claimed_size = 5}}), "which cannot be"},
      {zip_of({{.bytes = nine, .deflate = true, .directory_size = 100}}),
       "contradicts the directory"},
      {with({{offset, '\x7f'}}), "is no zip archive, or cut short"},
      {with({{offset, '\x7f'}, {offset + 2, '\x7f'}}), "is no zip archive, or cut short"},
      {nested_members(), "overlaps"},
      {with({{30, 'b'}}), "contradicts the directory"}};  // the name in the local header
  for (const auto& [bytes, says] : cases) {
    const std::string path = dir.write("a.npz", bytes);
    EXPECT_HAS(error_of([&] { Npz{path}; }), says);
  }
}

TEST_F(ReadersArrays, MembersThatLie) {
  const std::string bytes = counting(1000), shorter = bytes.substr(0, bytes.size() - 8);
  const size_t size = bytes.size();
  const std::pair<ZipEntry, const char*> cases[] = {
      {{.bytes = bytes, .deflate = true, .wrong_crc = 4}, "checksum"},
      {{.bytes = bytes, .wrong_crc = 4}, "checksum"},
      {{.bytes = bytes, .deflate = true, .claimed_size = size - 8}, "holds 7992"},
      {{.bytes = bytes, .deflate = true, .claimed_size = size + 8}, "holds 8008"},
      // Header and directory agree; what is packed is longer or shorter.
      {{.bytes = bytes + "12345678", .deflate = true, .claimed_size = size}, "more than the"},
      {{.bytes = shorter, .deflate = true, .claimed_size = size}, "fewer than the"},
      {{.bytes = bytes, .flags = 1}, "encrypted"},
      {{.bytes = bytes, .claimed_size = size, .method = 12}, "method 12"}};
  for (const auto& [entry, says] : cases) {
    const Npz file(dir.write("a.npz", zip_of({entry})));
    EXPECT_HAS(error_of([&] { file.array("a"); }), says);
  }
}

TEST_F(ReadersArrays, BombsStopAtTheMemoryLimit) {
  const int64_t n = 20 << 20;
  const std::string bomb = npy_as("|u1", {n}, std::string(static_cast<size_t>(n), '\0'));
  write_bytes(dir / "a.npz", npz({{"a", bomb}, {"b", counting(3)}}));
  EXPECT_LT(std::filesystem::file_size(dir / "a.npz"), 30000u);
  const Npz file(dir / "a.npz", 10 << 20);
  EXPECT_HAS(error_of([&] { file.array("a"); }), "--max-memory");
  EXPECT_EQ(file.array("b").size(), 3);
  EXPECT_EQ(Npz(dir / "a.npz", 30 << 20).array("a").size(), n);
}

/// Everything in the file, as the importers would.
void read_all(const std::string& path) {
  if (!is_npz_name(path)) {
    read_npy(path);
    return;
  }
  const Npz file(path);
  for (const std::string& name : file.names()) file.array(name);
}

TEST_F(ReadersArrays, CutAtEveryByte) {
  const std::string a = npy<float>({2, 3}, {1, 2, 3, 4, 5, 6}), b = npy_text("male");
  const std::pair<const char*, std::string> files[] = {
      {"x.npy", a},
      {"x.npz", npz({{"poses", a}, {"gender", b}})},
      {"y.npz", npz({{"poses", a}, {"gender", b}}, false)},
      {"z.npz", zip_of({{"poses.npy", a, true, true, true}}, "comment")}};
  for (const auto& file : files) {
    const std::string name = file.first, &bytes = file.second;
    write_bytes(dir / name, bytes);
    read_all(dir / name);
    for (size_t n = 0; n < bytes.size(); ++n) {
      std::filesystem::remove(dir / name);
      write_bytes(dir / name, bytes.substr(0, n));
      EXPECT_HAS(error_of([&] { read_all(dir / name); }), name) << n << " bytes";
    }
  }
}

// ---- frames ------------------------------------------------------------------------------------

TEST_F(ReadersArrays, CloudsAreFrames) {
  const auto one = open_frames(dir.write("one.npy", npy<double>({2, 3}, {1, 2, 3, 4, 5, 6})));
  EXPECT_EQ(one->frames(), 1);
  EXPECT_EQ(one->fps(), kFps);
  const auto frame = one->next();
  EXPECT_EQ(frame->points, (Points{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(frame->source, dir / "one.npy");
  EXPECT_FALSE(one->next());

  // Three frames of two points, in both orders, stored and packed.
  std::vector<float> c(18), f(18);
  for (size_t t = 0; t < 3; ++t)
    for (size_t i = 0; i < 2; ++i)
      for (size_t k = 0; k < 3; ++k)
        c[6 * t + 3 * i + k] = f[t + 3 * i + 6 * k] = static_cast<float>(100 * t + 10 * i + k);
  std::string bytes;
  for (const float value : f) bytes += raw(value);
  const std::string orders[] = {npy<float>({3, 2, 3}, c),
                                npy_of(npy_header("<f4", {3, 2, 3}, true), bytes)};
  for (const std::string& array : orders)
    for (const bool deflate : {false, true}) {
      write_bytes(dir / "s.npz",
                  npz({{"fps", npy<int64_t>({}, {60})}, {"points", array}}, deflate));
      const auto many = open_frames(dir / "s.npz");
      EXPECT_EQ(many->frames(), 3);
      EXPECT_EQ(many->fps(), 60);
      many->skip();
      EXPECT_EQ(many->next()->points, (Points{{100, 101, 102}, {110, 111, 112}}));
      const auto last = many->next();
      EXPECT_EQ(last->points[1], Point(210, 211, 212));
      EXPECT_EQ(last->source, dir / "s.npz:2");
      EXPECT_FALSE(many->next());
      many->rewind();
      EXPECT_EQ(many->next()->points[0], Point(0, 1, 2));
    }
  EXPECT_HAS(error_of([&] { read_array_frame(dir / "s.npz"); }), "sequence of 3");
}

TEST_F(ReadersArrays, WhichArrayIsTheCloud) {
  const std::string cloud = npy<float>({1, 3}, {1, 2, 3}), other = npy<float>({1, 3}, {9, 9, 9});
  const auto first = [&](const Arrays& arrays) {
    return open_frames(dir.write("a.npz", npz(arrays)))->next()->points[0];
  };
  const Arrays with_a_cloud[] = {{{"normals", other}, {"points", cloud}},
                                 {{"transl", npy<float>({3}, {9, 9, 9})},  // CAPE
                                  {"v_cano", other},
                                  {"v_posed", cloud},
                                  {"pose", npy<float>({72}, std::vector<float>(72, 0))}},
                                 {{"faces", npy<int64_t>({1, 3}, {0, 0, 0})}, {"my_scan", cloud}},
                                 {{"labels", npy_as("|O", {}, "x")}, {"my_scan", cloud}}};
  for (const Arrays& arrays : with_a_cloud) EXPECT_EQ(first(arrays), Point(1, 2, 3));
  const std::pair<Arrays, const char*> without[] = {
      {{{"a", cloud}, {"b", other}}, "several arrays of points: 'a', 'b'"},
      {{{"labels", npy<float>({2}, {1, 2})}}, "holds no points (its arrays: 'labels')"},
      {{{"points", npy<float>({0, 5, 3}, {})}}, "holds no points"},
      // Parameters of a body model: `trans` has the shape of a cloud and is none.
      {{{"smpl_thetas", npy<float>({2, 72}, std::vector<float>(144, 0))}, {"trans", cloud}},
       "is a motion of a body model"},
      {{{"global_orient", cloud},
        {"body_pose", npy<float>({1, 69}, std::vector<float>(69, 0))},
        {"transl", cloud}},
       "is a motion of a body model"},
      {{{"trans", cloud}, {"betas", npy<float>({10}, std::vector<float>(10, 0))}},
       "holds no points"},
      {{{"points", cloud}, {"fps", npy<float>({}, {0})}}, "fps: is no frame rate"},
      {{{"points", cloud}, {"fps", npy_text("30")}}, "fps: is no frame rate"}};
  for (const auto& [arrays, says] : without)
    EXPECT_HAS(error_of([&, &held = arrays] { first(held); }), says);
  dir.write("b.npy", npy<float>({4}, {1, 2, 3, 4}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.npy"); }), "array [4], which is no cloud");
}

TEST_F(ReadersArrays, FoldersOfArrays) {
  for (const int i : {10, 2, 1})
    write_bytes(dir / ("f" + std::to_string(i) + ".npz"),
                npz({{"v_posed", npy<double>({1, 3}, {double(i), 0, 0})}}));
  const auto frames = open_frames(dir.path());
  EXPECT_EQ(frames->frames(), 3);
  EXPECT_EQ(frames->next()->points[0], Point(1, 0, 0));
  frames->skip();
  const auto last = frames->next();
  EXPECT_EQ(last->points[0], Point(10, 0, 0));
  EXPECT_EQ(last->source, dir / "f10.npz");
  frames->skip();
  EXPECT_FALSE(frames->next());
  // One mesh beside a series of arrays is a template or the like.
  write_bytes(dir / "scan.obj", "v 7 7 7\n");
  EXPECT_EQ(open_frames(dir.path())->frames(), 3);
  EXPECT_HAS(open_frames(dir.path())->remarks().at(0), "left out 1 .obj file");
  // Beside a series of meshes arrays are something else.
  for (const char* name : {"m1.obj", "m2.obj"}) write_bytes(dir / name, "v 7 7 7\n");
  EXPECT_EQ(open_frames(dir.path())->frames(), 2);
}

// ---- axes --------------------------------------------------------------------------------------

/// An array of this shape whose element says what it is: point + 1000 * frame + 0.25 * axis, each
/// of these the index of the axis of that number (-1: none).
std::string marked(const std::vector<int64_t>& shape, int frame, int point, int xyz) {
  int64_t count = 1;
  for (const int64_t n : shape) count *= n;
  std::vector<float> values;
  for (int64_t i = 0; i < count; ++i) {
    std::vector<int64_t> at(shape.size());
    int64_t rest = i;
    for (size_t a = shape.size(); a-- > 0; rest /= shape[a]) at[a] = rest % shape[a];
    const auto index = [&](int axis) { return axis < 0 ? 0 : at[static_cast<size_t>(axis)]; };
    values.push_back(static_cast<float>(index(point) + 1000 * index(frame)) +
                     0.25f * static_cast<float>(index(xyz)));
  }
  return npy<float>(shape, values);
}

TEST_F(ReadersArrays, AxesInAnyOrderAndMoreColumns) {
  struct Case {
    std::vector<int64_t> shape;
    int frame, point, xyz;
    int64_t frames, points;
  };
  const Case cases[] = {
      {{80, 3}, -1, 0, 1, 1, 80},   {{80, 6}, -1, 0, 1, 1, 80},     {{80, 4}, -1, 0, 1, 1, 80},
      {{3, 80}, -1, 1, 0, 1, 80},   {{4, 80, 3}, 0, 1, 2, 4, 80},   {{4, 80, 6}, 0, 1, 2, 4, 80},
      {{80, 3, 4}, 2, 0, 1, 4, 80}, {{4, 3, 80}, 0, 2, 1, 4, 80},   {{3, 80, 4}, 2, 1, 0, 4, 80},
      {{80, 3, 3}, 2, 0, 1, 3, 80}, {{2, 1, 80, 3}, 0, 2, 3, 2, 80}};
  for (const Case& c : cases) {
    const auto frames = open_frames(dir.write("a.npy", marked(c.shape, c.frame, c.point, c.xyz)));
    ASSERT_EQ(frames->frames(), c.frames) << shape_text(c.shape);
    frames->skip();
    frames->rewind();
    for (int64_t f = 0; f < c.frames; ++f) {
      const auto frame = frames->next();
      ASSERT_EQ(std::ssize(frame->points), c.points) << shape_text(c.shape);
      const float x = static_cast<float>(1000 * f + 17);
      EXPECT_EQ(frame->points[17], Point(x, x + 0.25f, x + 0.5f)) << shape_text(c.shape);
    }
    const bool plain = c.shape.back() == 3 && c.shape != std::vector<int64_t>{80, 3, 3};
    EXPECT_EQ(frames->remarks().empty(), plain) << shape_text(c.shape);
  }
  for (const std::vector<int64_t>& shape :
       {std::vector<int64_t>{80}, {80, 2}, {80, 66}, {5, 80, 72}})
    EXPECT_FALSE(cloud_axes(shape)) << shape_text(shape);
  // Pictures of a depth camera are one frame, not 288 of 320 points.
  EXPECT_EQ(cloud_axes({288, 320, 3})->points, 288 * 320);
  EXPECT_FALSE(cloud_axes({288, 320, 3})->sequence);
  EXPECT_EQ(cloud_axes({5, 288, 320, 3})->frames, 5);
  // Who knows the number of vertices knows which axis is which.
  EXPECT_EQ(cloud_axes({70, 3, 300}, 70)->frames, 300);
}

/// Numbers that stand behind each other in an order of their own: frames, points, x y z.
using Element = std::function<double(int64_t frame, int64_t point, int axis)>;

std::string array_in_order(const std::vector<int64_t>& shape, const std::vector<int>& axis_of,
                           const Element& element) {
  std::vector<float> values;
  int64_t count = 1;
  for (const int64_t n : shape) count *= n;
  for (int64_t i = 0; i < count; ++i) {
    int64_t at[3] = {0, 0, 0}, rest = i;
    for (size_t a = shape.size(); a-- > 0; rest /= shape[a]) at[axis_of[a]] = rest % shape[a];
    values.push_back(static_cast<float>(element(at[0], at[1], static_cast<int>(at[2]))));
  }
  return npy<float>(shape, values);
}

/// Somebody of scattered points, who walks along z.
double walker(int64_t frame, int64_t point, int axis) {
  const double spread[] = {0.3, 0.9, 0.2};
  return spread[axis] * std::sin(7.3 * static_cast<double>(point) + 2.1 * axis) +
         (axis == 2 ? 0.03 : 0.004) * static_cast<double>(frame);
}

TEST_F(ReadersArrays, ChannelsAndPointsMayComeFirst) {
  const auto expect = [&](const std::string& array, int64_t frames, int64_t points,
                          const char* says) {
    const auto found = open_frames(dir.write("a.npy", array));
    ASSERT_EQ(found->frames(), frames) << says;
    for (int64_t f = 0; f < frames; ++f) {
      const auto frame = found->next();
      ASSERT_EQ(std::ssize(frame->points), points) << says;
      for (const int64_t i : {int64_t{0}, points / 2, points - 1})
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_EQ(frame->points[static_cast<size_t>(i)][axis],
                    static_cast<float>(walker(f, i, axis)))
              << says;
    }
    ASSERT_EQ(found->remarks().size(), 1u) << says;
    EXPECT_HAS(found->remarks()[0], says);
  };
  const auto with_colours = [](int64_t f, int64_t i, int axis) {
    return axis < 3 ? walker(f, i, axis) : 255.0;
  };
  expect(array_in_order({6, 90}, {2, 1}, with_colours), 1, 90, "[6 numbers, 90 points]");
  expect(array_in_order({4, 6, 90}, {0, 2, 1}, with_colours), 4, 90, "[frames, 6 numbers, 90");
  expect(array_in_order({90, 70, 3}, {1, 0, 2}, walker), 70, 90, "[90 points, 70 frames, xyz]");
  expect(array_in_order({900, 20, 3}, {1, 0, 2}, walker), 20, 900, "[900 points, 20 frames");
  expect(array_in_order({90, 5, 3}, {1, 0, 2}, walker), 5, 90, "[90 points, 5 frames");
  const auto still = [](int64_t, int64_t i, int axis) { return walker(0, i, axis); };
  const auto seen = open_frames(dir.write("a.npy", array_in_order({90, 70, 3}, {1, 0, 2}, still)));
  EXPECT_EQ(seen->frames(), 70);
  // A camera's picture.
  EXPECT_EQ(cloud_axes({3, 288, 320})->points, 288 * 320);
  EXPECT_EQ(cloud_axes({3, 288, 320})->frames, 1);
  EXPECT_EQ(cloud_axes({5, 3, 288, 320})->frames, 5);
}

TEST_F(ReadersArrays, FramesThatComeFirstStayFramesHoweverFarSomebodyRuns) {
  for (const double speed : {0.0, 0.03, 0.3}) {
    const auto runner = [&](int64_t f, int64_t i, int axis) {
      return walker(0, i, axis) + (axis == 2 ? speed * static_cast<double>(f) : 0.0);
    };
    const auto found =
        open_frames(dir.write("a.npy", array_in_order({300, 70, 3}, {0, 1, 2}, runner)));
    EXPECT_EQ(found->frames(), 300) << speed;
    EXPECT_TRUE(found->remarks().empty()) << speed;
  }
}

TEST_F(ReadersArrays, AColumnThatCountsThePointsIsNoCoordinate) {
  for (const double first : {0.0, 1000.0})
    for (const double step : {1.0, 0.033})
      for (const int64_t columns : {4, 7}) {
        const auto numbered = [&](int64_t f, int64_t i, int axis) {
          if (axis == 0) return first + step * static_cast<double>(i);
          return axis < 4 ? walker(f, i, axis - 1) : 0.5;
        };
        const std::string arrays[] = {array_in_order({90, columns}, {1, 2}, numbered),
                                      array_in_order({columns, 90}, {2, 1}, numbered),
                                      array_in_order({5, 90, columns}, {0, 1, 2}, numbered)};
        for (const std::string& array : arrays) {
          const auto found = open_frames(dir.write("a.npy", array));
          const auto frame = found->next();
          EXPECT_EQ(frame->points[17], Point(static_cast<float>(walker(0, 17, 0)),
                                             static_cast<float>(walker(0, 17, 1)),
                                             static_cast<float>(walker(0, 17, 2))));
          EXPECT_HAS(found->remarks().at(0), "numbers the points");
        }
      }
  // A cloud in the order of x has unequal steps.
  const auto sorted = [](int64_t f, int64_t i, int axis) {
    return axis == 0 ? static_cast<double>(i) + 0.4 * std::sin(5.0 * static_cast<double>(i))
                     : walker(f, i, axis - 1);
  };
  const auto found = open_frames(dir.write("a.npy", array_in_order({90, 4}, {1, 2}, sorted)));
  EXPECT_FLOAT_EQ(found->next()->points[1].x(), 1 + 0.4f * std::sin(5.0f));
}

TEST_F(ReadersArrays, PathsAndSignalsAreNoCloudsByTheirNames) {
  const std::string path = npy<float>({80, 3}, std::vector<float>(240, 1));
  for (const char* name : {"root_pos", "rootPos", "com", "gyro", "imu_accel", "trans", "pelvis",
                           "angular_velocity", "keypoints3d", "markers", "cam_trans"}) {
    dir.write("a.npz", npz({{name, path}}));
    EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "holds no points") << name;
    dir.write("b.npz", npz({{name, path}, {"frames", npy<float>({1, 3}, {1, 2, 3})}}));
    EXPECT_EQ(open_frames(dir / "b.npz")->next()->points.size(), 1u) << name;
  }
  for (const char* name : {"camera_points", "pose_vertices", "scan_of_root", "pose_0001"})
    EXPECT_EQ(open_frames(dir.write("a.npz", npz({{name, path}})))->next()->points.size(), 80u);
}

TEST_F(ReadersArrays, OnePartOfABodysRotationsNamesTheOther) {
  const std::string root = npy<float>({2, 3}, std::vector<float>(6, 0)),
                    body = npy<float>({2, 63}, std::vector<float>(126, 0));
  dir.write("a.npz", npz({{"root_orient", root}, {"trans", root}, {"betas", root}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "and not of the other joints");
  EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "add pose_body");
  dir.write("b.npz", npz({{"pose_body", body}, {"trans", root}, {"betas", root}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.npz"); }), "add root_orient");
  dir.write("c.npz", npz({{"pred_rotmat", npy<float>({2, 24, 3, 3}, std::vector<float>(432, 0))}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "c.npz"); }), "is a motion of a body model");
}

/// As numpy.savez(*clouds) keeps clouds of unequal size.
TEST_F(ReadersArrays, NumberedArraysAreTheFramesOfASequence) {
  Arrays arrays;
  for (const int i : {0, 1, 10, 2}) {
    std::vector<float> values(static_cast<size_t>(3 * (i + 1)), static_cast<float>(i));
    arrays.emplace_back("arr_" + std::to_string(i), npy<float>({i + 1, 3}, values));
  }
  dir.write("a.npz", npz(arrays));
  EXPECT_TRUE(find_cloud(dir / "a.npz")->axes.sequence);
  const auto frames = open_frames(dir / "a.npz");
  EXPECT_EQ(frames->frames(), 4);
  EXPECT_HAS(frames->remarks().at(0), "'arr_0' to 'arr_10'");
  for (const int i : {0, 1, 2, 10}) {
    const auto frame = frames->next();
    EXPECT_EQ(frame->points,
              Points(static_cast<size_t>(i + 1), Point::Constant(static_cast<float>(i))));
  }
  EXPECT_FALSE(frames->next());
  EXPECT_HAS(error_of([&] { read_array_frame(dir / "a.npz"); }), "sequence of 4");
}

TEST_F(ReadersArrays, NonFinitePointsAreLeftOutAndFramesMayBeEmpty) {
  dir.write("in/1.npy", npy<float>({2, 3}, {1, NAN, 3, 4, 5, 6}));
  dir.write("in/2.npy", npy<float>({0, 3}, {}));
  dir.write("in/3.npy", npy<float>({1, 3}, {INFINITY, 0, 0}));
  const auto frames = open_frames(dir / "in");
  const auto first = frames->next();
  EXPECT_EQ(first->points, (Points{{4, 5, 6}}));
  EXPECT_EQ(first->left_out, 1u);
  EXPECT_TRUE(frames->next()->points.empty());
  EXPECT_EQ(frames->next()->left_out, 1u);
}

}  // namespace
}  // namespace restage
