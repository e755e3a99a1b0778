// NPY and NPZ: every number, order and packing that numpy writes; one clear line for what is
// damaged, hostile or not read on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/frames/array_frames.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersArrays = FileTest;

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
  EXPECT_HAS(error_of([&] { array_of(npy<double>({4}, {1, 2, 3, 4}), 31); }), "max_memory");
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
  EXPECT_HAS(error_of([&] { file.array("a"); }), "max_memory");
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

}  // namespace
}  // namespace restage
