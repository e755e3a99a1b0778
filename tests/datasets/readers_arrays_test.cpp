// NPY and NPZ: every number, order and packing that numpy writes; one clear line for what is
// damaged, hostile or not read on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/readers/array_frames.h"
#include "datasets/readers/npz.h"
#include "tests/datasets/npz_support.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

using test::error_of;
using test::npy;
using test::npy_header;
using test::npy_of;
using test::npz;
using test::raw;
using test::TempDir;
using test::zip_of;
using test::ZipEntry;

NpyArray array_of(const TempDir& dir, const std::string& bytes, uint64_t limit = kMaxMemory) {
  test::write_bytes(dir / "a.npy", bytes);
  return read_npy(dir / "a.npy", limit);
}

std::string refusal(const TempDir& dir, const std::string& bytes) {
  return error_of([&] { array_of(dir, bytes); });
}

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

// ---- NPY ---------------------------------------------------------------------------------------

template <class T>
void expect_numbers(const std::string& type, const std::vector<T>& values) {
  const TempDir dir;
  for (const bool big : {false, true}) {
    std::string bytes;
    for (const T value : values) {
      std::string one = raw(value);
      if (big) std::reverse(one.begin(), one.end());
      bytes += one;
    }
    const std::string order = sizeof(T) == 1 ? "|" : big ? ">" : "<";
    const NpyArray array = array_of(
        dir, npy_of(npy_header(order + type, {static_cast<int64_t>(values.size())}), bytes));
    ASSERT_EQ(array.size(), static_cast<int64_t>(values.size()));
    for (size_t i = 0; i < values.size(); ++i)
      EXPECT_EQ(array[static_cast<int64_t>(i)], static_cast<double>(values[i])) << type << big;
  }
}

TEST(ReadersArrays, AllNumbersInBothByteOrders) {
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

TEST(ReadersArrays, HalfPrecision) {
  const TempDir dir;
  const std::pair<uint16_t, double> cases[] = {
      {0x0000, 0.0},     {0x3c00, 1.0},     {0xc000, -2.0},      {0x3555, 0.333251953125},
      {0x7bff, 65504.0}, {0x0001, 0x1p-24}, {0x03ff, 0x3ffp-24}, {0x0400, 0x1p-14}};
  std::string little, big;
  for (const auto& [bits, value] : cases) {
    little += raw(bits);
    big += raw(static_cast<uint16_t>(bits << 8 | bits >> 8));
  }
  const NpyArray a = array_of(dir, npy_of(npy_header("<f2", {8}), little));
  const NpyArray b = array_of(dir, npy_of(npy_header(">f2", {8}), big));
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(a[i], cases[i].second);
    EXPECT_EQ(b[i], cases[i].second);
  }
  const NpyArray c = array_of(dir, npy_of(npy_header("<f2", {2}), raw(uint32_t{0x7e00fc00})));
  EXPECT_EQ(c[0], -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(c[1]));
  EXPECT_HAS(error_of([&] { c.finite(); }), "infinity at element 0");
}

TEST(ReadersArrays, OrdersVersionsAndScalars) {
  const TempDir dir;
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
          array_of(dir, npy_of(npy_header("<f8", {2, 3, 2}, fortran), bytes, version));
      EXPECT_EQ(array.shape(), (std::vector<int64_t>{2, 3, 2}));
      EXPECT_EQ(array.finite(), c);
    }
  const NpyArray scalar = array_of(dir, npy<double>({}, {120.0}));
  EXPECT_TRUE(scalar.shape().empty());
  EXPECT_EQ(scalar.finite(), std::vector<double>{120.0});
  EXPECT_EQ(array_of(dir, npy<float>({0, 3}, {})).size(), 0);
  // As Python 2 and hand-made headers look.
  EXPECT_EQ(array_of(dir, npy_of("{\"shape\":(1L,),'descr':'<i8' , 'fortran_order':False}",
                                 raw(int64_t{7})))[0],
            7);
}

TEST(ReadersArrays, Text) {
  const TempDir dir;
  EXPECT_EQ(array_of(dir, test::npy_text("female")).text(), "female");
  EXPECT_EQ(array_of(dir, npy_of(npy_header("|S8", {}), std::string("male\0\0\0\0", 8))).text(),
            "male");
  const std::string big = std::string("\0\0\0\xe9\0\0\x20\xac\0\1\xf6\0", 12);
  EXPECT_EQ(array_of(dir, npy_of(npy_header(">U3", {1}), big)).text(), "é€😀");
  EXPECT_EQ(array_of(dir, npy_of(npy_header("<U0", {}), "")).text(), "");
  EXPECT_EQ(array_of(dir, npy_of(npy_header("<U2", {0}), "")).text(), "");
}

TEST(ReadersArrays, WhatIsNotRead) {
  const TempDir dir;
  EXPECT_HAS(refusal(dir, npy_of(npy_header("|O", {}), "\x80\x03X")), "pickle");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f16", {1}), std::string(16, '\0'))), "'<f16'");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<c8", {1}), std::string(8, '\0'))), "'<c8'");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<M8[ns]", {1}), std::string(8, '\0'))), "header");
  EXPECT_HAS(refusal(dir, npy_of("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (), }",
                                 std::string(4, '\0'))),
             "records");
  EXPECT_HAS(refusal(dir, "no array"), "is no NPY array");
  EXPECT_HAS(refusal(dir, ""), "is no NPY array");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f8", {1}), std::string(8, '\0'), 4)), "version");
  for (const char* header :
       {"", "{}", "{'descr': '<f8'}", "{'descr': '<f8', 'descr': '<f8', 'shape': ()}",
        "{'descr': '<f8', 'fortran_order': Maybe, 'shape': ()}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (), 'x': ()}",
        "{'descr': '', 'fortran_order': False, 'shape': ()}",
        "{'descr': '<', 'fortran_order': False, 'shape': ()}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': ()} more"})
    EXPECT_HAS(refusal(dir, npy_of(header, std::string(8, '\0'))), "a.npy: ");
}

TEST(ReadersArrays, LengthsAreNeverBelieved) {
  const TempDir dir;
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f8", {2}), std::string(15, '\0'))), "cut short");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f8", {2}), std::string(17, '\0'))),
             "save one array a file");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f8", {1 << 20, 1 << 20, 1 << 20}), "")),
             "impossible shape");
  EXPECT_HAS(refusal(dir, npy_of(npy_header("<f8", {int64_t{1} << 43}), "12345678")),
             "should hold");
  std::string endless = npy<double>({1}, {1.0});
  endless[8] = endless[9] = '\xff';  // a header longer than the file
  EXPECT_HAS(refusal(dir, endless), "cut short");
  EXPECT_HAS(error_of([&] { array_of(dir, npy<double>({4}, {1, 2, 3, 4}), 31); }), "--max-memory");
}

// ---- NPZ ---------------------------------------------------------------------------------------

std::string opened(const TempDir& dir, const std::string& bytes) {
  test::write_bytes(dir / "a.npz", bytes);
  return error_of([&] { Npz(dir / "a.npz"); });
}

ZipEntry entry(const std::string& name, const std::string& bytes, bool deflate = false) {
  ZipEntry out;
  out.name = name;
  out.bytes = bytes;
  out.deflate = deflate;
  return out;
}

std::string counting(int n) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(i);
  return npy<double>({n}, values);
}

TEST(ReadersArrays, EveryPackingOfZip) {
  const TempDir dir;
  for (int variant = 0; variant < 8; ++variant) {
    std::vector<ZipEntry> entries = {entry("x.npy", counting(1000)), entry("readme.txt", "hello"),
                                     entry("folder/y.npy", counting(3))};
    for (ZipEntry& e : entries) {
      e.deflate = (variant & 1) != 0;
      e.zip64 = (variant & 2) != 0;
      e.descriptor = (variant & 4) != 0;
    }
    test::write_bytes(dir / "a.npz", zip_of(entries, variant % 3 ? "PK\5\6 a comment" : ""));
    const Npz file(dir / "a.npz");
    EXPECT_EQ(file.names(), (std::vector<std::string>{"x", "folder/y"}));
    EXPECT_TRUE(file.has("x"));
    EXPECT_FALSE(file.has("readme"));
    const NpyArray x = file.array("x");
    ASSERT_EQ(x.size(), 1000);
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(x[i], i);
    EXPECT_EQ(file.array("folder/y").finite(), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(file.header("x").shape, std::vector<int64_t>{1000});
    EXPECT_HAS(error_of([&] { file.array("z"); }), "has no array 'z' (it has 'x', 'folder/y')");
  }
  test::write_bytes(dir / "a.npz", zip_of({}));
  EXPECT_TRUE(Npz(dir / "a.npz").names().empty());
}

TEST(ReadersArrays, AMemberCanBeReadAgainAndSkippedInto) {
  const TempDir dir;
  for (const bool deflate : {false, true}) {
    std::string text;
    for (int i = 0; i < 300000; ++i) text += static_cast<char>('a' + i % 23);
    test::write_bytes(dir / "a.zip", zip_of({entry("t", text, deflate)}));
    const ZipFile file(dir / "a.zip");
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

TEST(ReadersArrays, ArchivesThatContradictThemselves) {
  const TempDir dir;
  EXPECT_HAS(opened(dir, "no archive at all"), "is no zip archive");
  EXPECT_HAS(opened(dir, ""), "is no zip archive");
  EXPECT_HAS(opened(dir, zip_of({entry("a.npy", "1"), entry("a.npy", "2")})), "two members");

  ZipEntry again = entry("a.npy", counting(9));
  again.same_place = true;  // the quine and bomb of overlapping members
  ZipEntry first = entry("a.npy", counting(9));
  again.name = "b.npy";
  EXPECT_HAS(opened(dir, zip_of({first, again})), "contradicts the directory");

  // A member that lies in the bytes of another: bombs are made so.
  const ZipEntry inner = entry("b.npy", counting(99));
  std::string nested = zip_of({inner});
  const std::string bytes = nested.substr(0, nested.find("PK\1\2"));
  nested = zip_of({entry("a.npy", bytes), inner});
  const auto put = [&](size_t at, size_t value) {
    nested.replace(at, 4, test::raw(static_cast<uint32_t>(value)));
  };
  const size_t begin = nested.find(bytes), end = begin + bytes.size();
  nested.erase(end, bytes.size());
  put(nested.rfind("PK\1\2") + 42, begin);  // where the second member is
  put(nested.rfind("PK\5\6") + 16, end);    // and the directory
  EXPECT_HAS(opened(dir, nested), "overlaps");

  ZipEntry liar = entry("a.npy", counting(9), true);
  liar.claimed_size = uint64_t{1} << 40;
  liar.zip64 = true;
  EXPECT_HAS(opened(dir, zip_of({liar})), "which cannot be");
  liar = entry("a.npy", counting(9));
  liar.claimed_size = 5;
  EXPECT_HAS(opened(dir, zip_of({liar})), "which cannot be");
  liar = entry("a.npy", counting(9), true);
  liar.directory_size = 100;
  EXPECT_HAS(opened(dir, zip_of({liar})), "contradicts the directory");

  std::string outside = zip_of({entry("a.npy", counting(9))});
  const size_t place = outside.find("PK\1\2") + 42;  // the member's offset
  outside[place] = '\x7f';
  EXPECT_HAS(opened(dir, outside), "is no zip archive, or cut short");
  outside[place + 2] = '\x7f';
  EXPECT_HAS(opened(dir, outside), "is no zip archive, or cut short");
  std::string other = zip_of({entry("a.npy", counting(9))});
  other[30] = 'b';  // the name in the local header
  EXPECT_HAS(opened(dir, other), "contradicts the directory");
}

TEST(ReadersArrays, MembersThatLie) {
  const TempDir dir;
  const auto reading = [&](const ZipEntry& e) {
    test::write_bytes(dir / "a.npz", zip_of({e}));
    const Npz file(dir / "a.npz");
    return error_of([&] { file.array("a"); });
  };
  const std::string bytes = counting(1000);
  ZipEntry e = entry("a.npy", bytes, true);
  e.wrong_crc = 4;
  EXPECT_HAS(reading(e), "checksum");
  e.deflate = false;
  EXPECT_HAS(reading(e), "checksum");
  e = entry("a.npy", bytes, true);
  e.claimed_size = bytes.size() - 8;
  EXPECT_HAS(reading(e), "holds 7992");
  e.claimed_size = bytes.size() + 8;
  EXPECT_HAS(reading(e), "holds 8008");
  e = entry("a.npy", bytes + "12345678", true);  // header and directory agree, the data is longer
  e.claimed_size = bytes.size();
  EXPECT_HAS(reading(e), "more than the");
  e = entry("a.npy", bytes.substr(0, bytes.size() - 8), true);
  e.claimed_size = bytes.size();
  EXPECT_HAS(reading(e), "fewer than the");
  e = entry("a.npy", bytes);
  e.flags = 1;
  EXPECT_HAS(reading(e), "encrypted");
  e.flags = 0;
  e.method = 12;
  e.claimed_size = bytes.size();
  EXPECT_HAS(reading(e), "method 12");
}

TEST(ReadersArrays, BombsStopAtTheMemoryLimit) {
  const TempDir dir;
  const int64_t n = 20 << 20;
  const std::string bomb =
      npy_of(npy_header("|u1", {n}), std::string(static_cast<size_t>(n), '\0'));
  test::write_bytes(dir / "a.npz", npz({{"a", bomb}, {"b", counting(3)}}));
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

TEST(ReadersArrays, CutAtEveryByte) {
  const TempDir dir;
  const std::string a = npy<float>({2, 3}, {1, 2, 3, 4, 5, 6}), b = test::npy_text("male");
  ZipEntry modern = entry("poses.npy", a, true);
  modern.zip64 = modern.descriptor = true;
  const std::pair<const char*, std::string> files[] = {
      {"x.npy", a},
      {"x.npz", npz({{"poses", a}, {"gender", b}})},
      {"y.npz", npz({{"poses", a}, {"gender", b}}, false)},
      {"z.npz", zip_of({modern}, "comment")}};
  for (const auto& file : files) {
    const std::string name = file.first, &bytes = file.second;
    test::write_bytes(dir / name, bytes);
    read_all(dir / name);
    for (size_t n = 0; n < bytes.size(); ++n) {
      std::filesystem::remove(dir / name);
      test::write_bytes(dir / name, bytes.substr(0, n));
      EXPECT_HAS(error_of([&] { read_all(dir / name); }), name) << n << " bytes";
    }
  }
}

// ---- frames ------------------------------------------------------------------------------------

TEST(ReadersArrays, CloudsAreFrames) {
  const TempDir dir;
  test::write_bytes(dir / "one.npy", npy<double>({2, 3}, {1, 2, 3, 4, 5, 6}));
  const auto one = open_frames(dir / "one.npy");
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
      test::write_bytes(dir / "s.npz",
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

TEST(ReadersArrays, WhichArrayIsTheCloud) {
  const TempDir dir;
  const std::string cloud = npy<float>({1, 3}, {1, 2, 3}), other = npy<float>({1, 3}, {9, 9, 9});
  const auto first = [&](const std::vector<std::pair<std::string, std::string>>& arrays) {
    test::write_bytes(dir / "a.npz", npz(arrays));
    return open_frames(dir / "a.npz")->next()->points[0];
  };
  EXPECT_EQ(first({{"normals", other}, {"points", cloud}}), Point(1, 2, 3));
  EXPECT_EQ(first({{"transl", npy<float>({3}, {9, 9, 9})},
                   {"v_cano", other},
                   {"v_posed", cloud},
                   {"pose", npy<float>({72}, std::vector<float>(72, 0))}}),
            Point(1, 2, 3));  // CAPE
  EXPECT_EQ(first({{"faces", npy<int64_t>({1, 3}, {0, 0, 0})}, {"my_scan", cloud}}),
            Point(1, 2, 3));
  EXPECT_EQ(first({{"labels", npy_of(npy_header("|O", {}), "x")}, {"my_scan", cloud}}),
            Point(1, 2, 3));
  const auto refused = [&](const std::vector<std::pair<std::string, std::string>>& arrays) {
    test::write_bytes(dir / "a.npz", npz(arrays));
    return error_of([&] { open_frames(dir / "a.npz")->next(); });
  };
  EXPECT_HAS(refused({{"a", cloud}, {"b", other}}), "several arrays of points: 'a', 'b'");
  EXPECT_HAS(refused({{"poses", npy<float>({2}, {1, 2})}}),
             "holds no points (its arrays: 'poses')");
  EXPECT_HAS(refused({{"points", npy<float>({0, 3}, {})}}), "holds no points");
  EXPECT_HAS(refused({{"points", npy<float>({1, 3}, {1, NAN, 3})}}), "NaN");
  EXPECT_HAS(refused({{"points", cloud}, {"fps", npy<float>({}, {0})}}), "fps: is no frame rate");
  test::write_bytes(dir / "b.npy", npy<float>({4}, {1, 2, 3, 4}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.npy"); }), "array [4], which is no cloud");
}

TEST(ReadersArrays, FoldersOfArrays) {
  const TempDir dir;
  for (const int i : {10, 2, 1})
    test::write_bytes(dir / ("f" + std::to_string(i) + ".npz"),
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
  // Meshes come first: arrays beside them are something else.
  test::write_bytes(dir / "scan.obj", "v 7 7 7\n");
  EXPECT_EQ(open_frames(dir.path())->frames(), 1);
}

}  // namespace
}  // namespace restage
