// The HDF5 wrapper: round trips, streaming, and refusal of everything that is not as it claims.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <zlib.h>

#include <cmath>
#include <csignal>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/hdf5/file.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/schema.h"
#include "tests/fuzz/old_layout.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using SchemaHdf5 = FileTest;

/// A file of one data set.
template <class T>
std::string write_one(const std::string& path, const std::string& name, const h5::Shape& shape,
                      const std::vector<T>& values) {
  h5::File file = h5::File::create(path);
  file.write<T>(name, shape, values);
  file.commit();
  return path;
}

TEST_F(SchemaHdf5, WritesAndReadsEveryTypeShapeAndAttribute) {
  const std::string path = dir / "a.h5";
  {
    h5::File file = h5::File::create(path);
    file.write<double>("/g/h/d", {2, 1, 2}, std::vector<double>{1.5, -2, 1e300, 4});
    file.write<float>("f", {3}, std::vector<float>{1, 2, 3});
    file.write<int64_t>("/i64", {1}, std::vector<int64_t>{int64_t{1} << 40});
    file.write<int16_t>("/i16", {2}, std::vector<int16_t>{-32768, 32767});
    file.write<uint8_t>("/u8", {0, 4}, std::vector<uint8_t>{});
    file.write<int32_t>("/scalar", {}, std::vector<int32_t>{7});
    file.set_text("/", "note", "metres, \xc3\xa9");
    file.set_text("/g", "empty", "");
    file.set_number("/f", "fps", 29.97);
    file.set_integer("/g/h", "n", -3);
    EXPECT_FALSE(std::filesystem::exists(path)) << "nothing may appear before commit";
    file.commit();
  }
  const h5::File file = h5::File::open(path);
  EXPECT_EQ(file.read<double>("/g/h/d", {-1, 1, 2}), (std::vector<double>{1.5, -2, 1e300, 4}));
  EXPECT_EQ(file.read<double>("/f", {3}), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(file.read<int64_t>("/i16", {2}), (std::vector<int64_t>{-32768, 32767}));
  EXPECT_EQ(file.read<float>("/i16", {2}), (std::vector<float>{-32768, 32767}));
  EXPECT_TRUE(file.read<uint8_t>("/u8", {-1, 4}).empty());
  EXPECT_EQ(file.dataset("/scalar").read<int32_t>(), std::vector<int32_t>{7});
  EXPECT_EQ(file.children(), (Names{"g", "f", "i64", "i16", "u8", "scalar"}));
  EXPECT_EQ(file.text("/", "note"), "metres, \xc3\xa9");
  EXPECT_EQ(file.text("/g", "empty"), "");
  EXPECT_EQ(file.text("/", "absent"), std::nullopt);
  EXPECT_EQ(file.number("/f", "fps"), 29.97);
  EXPECT_EQ(file.integer("/g/h", "n"), -3);
  EXPECT_EQ(error_of([&] { file.dataset("/i64").read<int32_t>(); }),
            path + ":/i64: holds 1099511627776, which is out of range; correct the value");
  EXPECT_HAS(error_of([&] { file.dataset("/f").read<int32_t>(); }), "holds fractions");
  EXPECT_HAS(error_of([&] { file.integer("/", "note"); }), "is not an integer");
}

TEST_F(SchemaHdf5, AppendsAndReadsRowsAcrossChunks) {
  const std::string path = dir / "rows.h5";
  const int64_t width = 30000;  // four rows to a chunk
  {
    h5::File file = h5::File::create(path);
    h5::Dataset set = file.create_appendable<float>("/rows", {width});
    for (int r = 0; r < 11; ++r) {
      const std::vector<float> row(static_cast<size_t>(width), static_cast<float>(r));
      set.append<float>(row);
    }
    EXPECT_EQ(set.rows(), 11);
    EXPECT_THROW(set.append<float>(std::vector<float>(7)), ShapeError);
    file.commit();
  }
  const h5::File file = h5::File::open(path);
  const h5::Dataset set = file.dataset("/rows", {11, width});
  std::vector<double> rows;
  set.read_rows(3, 2, rows);
  EXPECT_EQ(rows.size(), static_cast<size_t>(2 * width));
  EXPECT_EQ(rows.front(), 3);
  EXPECT_EQ(rows.back(), 4);
  EXPECT_HAS(error_of([&] { set.read_rows(10, 2, rows); }), "has 11 rows");
}

TEST_F(SchemaHdf5, EqualContentIsEqualBytesAndAbandonedFilesLeaveNothing) {
  for (const char* name : {"a.h5", "b.h5"}) {
    h5::File file = h5::File::create(dir / name);
    file.write<float>("/g/x", {2}, std::vector<float>{1, 2});
    file.set_text("/", "kind", "test");
    file.commit();
  }
  EXPECT_EQ(bytes_of(dir / "a.h5"), bytes_of(dir / "b.h5"));
  { h5::File::create(dir / "c.h5").write<float>("/x", {1}, std::vector<float>{1}); }
  EXPECT_EQ(names_in(dir.path()), (Names{"a.h5", "b.h5"}));
}

TEST_F(SchemaHdf5, SaysWhatIsWrongWithAFile) {
  const std::string path =
      write_one(dir / "whole.h5", "/joints", {1, 22, 3}, std::vector<float>(66));
  const std::string whole = bytes_of(path);
  dir.write("text.h5", "hello");
  dir.write("cut.h5", whole.substr(0, whole.size() / 2));
  for (const auto& [name, says] : {std::pair{"no.h5", "no.h5: cannot be read"},
                                   {"", "is not a file"},
                                   {"text.h5", "is not an HDF5 file"},
                                   {"cut.h5", "cut short"}})
    EXPECT_HAS(error_of([&, name = name] { h5::File::open(dir / name); }), says);
  EXPECT_HAS(error_of([&] { h5::File::create(dir / "no/such/x.h5"); }), "cannot be written");
  const h5::File file = h5::File::open(path);
  EXPECT_EQ(error_of([&] { file.dataset("/bodies/x"); }),
            path + ":/bodies/x: is missing; give a file that has it");
  const h5::Shape other = {-1, 21, 3};
  EXPECT_EQ(error_of([&] { file.dataset("/joints", other); }),
            path +
                ":/joints: is shaped [1, 22, 3] instead of [*, 21, 3]; store it as documented "
                "(datasets/README.md)");
  EXPECT_HAS(error_of([&] { file.children("/joints"); }), "is not a group");
}

TEST_F(SchemaHdf5, ChecksumFindsDamagedValues) {
  std::vector<double> values(5000);
  for (size_t i = 0; i < values.size(); ++i) values[i] = std::sin(static_cast<double>(i) * 0.7);
  const std::string path = write_one(dir / "x.h5", "/x", {5000}, values);
  std::string bytes = bytes_of(path);
  bytes[bytes.size() / 2] ^= 1;  // the values are most of the file
  write_bytes(path, bytes);
  EXPECT_HAS(error_of([&] { h5::File::open(path).dataset("/x").read<double>(); }),
             "/x: is damaged");
}

/// A file made with the bare library, as foreign programs do.
class RawFile {
 public:
  explicit RawFile(const std::string& path)
      : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~RawFile() { H5Fclose(id_); }
  /// `values` are of `memory`'s type; none: nothing is written.
  void add(const char* name, hid_t type, std::vector<hsize_t> dims, std::vector<hsize_t> chunk,
           int filter = 0, const void* values = nullptr, hid_t memory = 0) {
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t plist = H5Pcreate(H5P_DATASET_CREATE);
    if (!chunk.empty()) H5Pset_chunk(plist, static_cast<int>(chunk.size()), chunk.data());
    if (filter == H5Z_FILTER_NBIT) H5Pset_nbit(plist);
    const hid_t set = H5Dcreate2(id_, name, type, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    if (values != nullptr) H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    H5Dclose(set);
    H5Pclose(plist);
    H5Sclose(space);
  }
  hid_t id() const { return id_; }

 private:
  hid_t id_;
};

TEST_F(SchemaHdf5, RefusesClaimsThatTheFileCannotKeep) {
  const std::string path = dir / "claims.h5";
  {
    RawFile raw(path);
    const hsize_t huge = hsize_t{1} << 40;
    raw.add("/huge", H5T_NATIVE_FLOAT, {huge, 22, 3}, {1024, 22, 3});
    raw.add("/overflow", H5T_NATIVE_DOUBLE, {huge, huge}, {16, 16});
    raw.add("/hidden", H5T_NATIVE_DOUBLE, {0, huge, huge}, {1, 16, 16});
    raw.add("/chunk", H5T_NATIVE_DOUBLE, {hsize_t{1} << 28}, {hsize_t{1} << 28});
    raw.add("/packed", H5T_NATIVE_INT, {8}, {8}, H5Z_FILTER_NBIT);
    raw.add("/small", H5T_NATIVE_FLOAT, {4, 3}, {4, 3});
    const hid_t odd = H5Tcreate(H5T_COMPOUND, 8);
    H5Tinsert(odd, "a", 0, H5T_NATIVE_DOUBLE);
    raw.add("/compound", odd, {2}, {});
    H5Tclose(odd);
    const hid_t bits = H5Tcopy(H5T_STD_I32LE), one = H5Screate(H5S_SCALAR);
    H5Tset_precision(bits, 13);
    H5Aclose(H5Acreate2(raw.id(), "bits", bits, one, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(one);
    H5Tclose(bits);
    H5Lcreate_external("other.h5", "/x", raw.id(), "/link", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/nowhere", raw.id(), "/soft", H5P_DEFAULT, H5P_DEFAULT);
  }
  const h5::File file = h5::File::open(path);
  for (const auto& [name, says] : {std::pair{"/huge", "far more than the file stores"},
                                   {"/overflow", "claims an impossible size"},
                                   {"/hidden", "claims an impossible size"},
                                   {"/chunk", "chunks of impossible size"},
                                   {"/packed", "compressed by filter 5"},
                                   {"/compound", "neither plain numbers nor text"},
                                   {"/link", "link into another file"},
                                   {"/soft", "is missing"}})
    EXPECT_HAS(error_of([&, name = name] { file.dataset(name).read<double>(); }), says);
  EXPECT_HAS(error_of([&] { file.number("/", "bits"); }), "neither plain numbers nor text");
  EXPECT_EQ(file.read<double>("/small", {4, 3}), std::vector<double>(12, 0.0));
}

/// The root group says that its names are nowhere: the first look for one is refused in order, and
/// the second crashes the library. (libFuzzer's finding, cut down.)
TEST_F(SchemaHdf5, AFileThatCannotBeWalkedToItsEndIsRefusedWhole) {
  const std::string path = dir / "old.h5";
  write_old_layout(path);
  EXPECT_EQ(h5::File::open(path).children(), Names{"joints"});
  EXPECT_EQ(read_prediction(path).frames, 6);
  std::string bytes = bytes_of(path);
  ASSERT_EQ(bytes.substr(136, 4), "TREE") << "the library lays the file out in another way";
  bytes.replace(128, 8, 8, '\xff');  // the address of the names
  bytes[143] = '\xff';               // and how many there are
  write_bytes(path, bytes);
  EXPECT_HAS(error_of([&] {
               const h5::File file = h5::File::open(path);
               for (int i = 0; i < 2; ++i) file.has("/joints");
             }),
             "damaged, cut short");
}

/// A host that ignores SIGCHLD never hears how a child ended.
TEST_F(SchemaHdf5, IsReadInAHostThatIgnoresSigchld) {
  const std::string good = dir / "good.h5", bad = dir / "bad.h5";
  write_one(good, "/joints", {2}, std::vector<float>(2));
  std::string bytes = bytes_of(good);
  bytes.resize(bytes.size() / 2);
  write_bytes(bad, bytes);
  const struct Ignored {
    ~Ignored() { std::signal(SIGCHLD, before); }
    void (*before)(int) = std::signal(SIGCHLD, SIG_IGN);
  } ignored;
  EXPECT_NO_THROW(h5::File::open(good));
  EXPECT_HAS(error_of([&] { h5::File::open(bad); }), "damaged, cut short");
}

/// AddressSanitizer ends a process whose allocation fails.
#ifdef __has_feature
constexpr bool kEndsWithoutMemory = __has_feature(address_sanitizer);
#else
constexpr bool kEndsWithoutMemory = false;
#endif

/// zlib's packing of so many MiB of zeros: the same piece again and again.
std::string packed_zeros(uint32_t mebibytes) {
  const std::string zeros(size_t{1} << 20, '\0');
  z_stream state{};
  deflateInit(&state, 9);
  const auto pack = [&](size_t n, int flush) {
    std::string out(size_t{1} << 20, '\0');
    state.next_in = reinterpret_cast<unsigned char*>(const_cast<char*>(zeros.data()));
    state.avail_in = static_cast<unsigned>(n);
    state.next_out = reinterpret_cast<unsigned char*>(out.data());
    state.avail_out = static_cast<unsigned>(out.size());
    deflate(&state, flush);
    out.resize(out.size() - state.avail_out);
    return out;
  };
  std::string out = pack(zeros.size(), Z_FULL_FLUSH);
  const std::string again = pack(zeros.size(), Z_FULL_FLUSH);
  for (uint32_t i = 1; i < mebibytes; ++i) out += again;
  out += pack(0, Z_FINISH);
  deflateEnd(&state);
  const uint32_t sum = static_cast<uint32_t>((uint64_t{mebibytes} << 20) % 65521) << 16 | 1;
  for (int i = 0; i < 4; ++i) out[out.size() - 4 + i] = static_cast<char>(sum >> (24 - 8 * i));
  return out;
}

/// 2 MB that unpack to 2 GiB, in one chunk, in the oldest and in the newest layout: the child that
/// reads it first is stopped, and nobody else begins.
TEST_F(SchemaHdf5, AFileThatFillsTheMemoryIsStoppedInItsChild) {
  const std::string packed = packed_zeros(2048), path = dir / "bomb.h5";
  for (const bool newest : {false, true}) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS), creation = H5Pcreate(H5P_DATASET_CREATE);
    if (newest) H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
    const hsize_t size = uint64_t{2048} << 20, start = 0;
    H5Pset_chunk(creation, 1, &size);
    H5Pset_deflate(creation, 9);
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t set =
        H5Dcreate2(file, "/joints", H5T_STD_U8LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &start, packed.size(), packed.data()), 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Fclose(file);
    H5Pclose(creation);
    H5Pclose(access);
    const std::string refusal = error_of([&] { h5::File::open(path); });
    EXPECT_HAS(refusal, kEndsWithoutMemory ? "damaged" : "takes more than 1024 MiB to read");
  }
}

TEST_F(SchemaHdf5, WhatOneReadTakesIsLimited) {
  const std::string path = dir / "large.h5";
  write_one(path, "/points", {1'000'000, 3}, std::vector<float>(3'000'000));
  const struct Limit {
    explicit Limit(uint64_t bytes) { h5::set_max_memory(bytes); }
    ~Limit() { h5::set_max_memory(kMaxMemory); }
  } limit(10'000'000);
  const h5::File file = h5::File::open(path);
  const h5::Dataset set = file.dataset("/points", {-1, 3});
  const std::string said = error_of([&] { set.read<float>(); });
  EXPECT_HAS(said, "large.h5:/points: ");
  EXPECT_HAS(said, "10000000 bytes allowed");
  EXPECT_HAS(said, "max_memory");
  std::vector<float> rows;
  set.read_rows(0, 800'000, rows);  // some of it may be in memory
  std::vector<double> twice;
  EXPECT_THROW(set.read_rows(0, 800'000, twice), InputError) << "doubles take twice as much";
  h5::set_max_memory(100'000);
  EXPECT_HAS(error_of([&] { file.dataset("/points"); }), "chunks");
}

TEST_F(SchemaHdf5, ReadsForeignByteOrdersAndText) {
  const std::string path = dir / "foreign.h5";
  {
    RawFile raw(path);
    const double values[2] = {0.5, -3};
    raw.add("/big", H5T_IEEE_F32BE, {2}, {}, 0, values, H5T_NATIVE_DOUBLE);
    const hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, H5T_VARIABLE);
    H5Tset_cset(text, H5T_CSET_UTF8);
    const char* words[2] = {"left_hip", ""};
    raw.add("/names", text, {2}, {}, 0, words, text);
    const hid_t one = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate2(raw.id(), "kind", text, one, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, text, &words[0]);
    H5Aclose(attribute);
    H5Sclose(one);
    H5Tclose(text);
  }
  const h5::File file = h5::File::open(path);
  EXPECT_EQ(file.read<double>("/big", {2}), (std::vector<double>{0.5, -3}));
  EXPECT_EQ(file.dataset("/names").read_text(), (Names{"left_hip", ""}));
  EXPECT_EQ(file.text("/", "kind"), "left_hip");
}

TEST_F(SchemaHdf5, AFullDiskIsOneWorkErrorAndLeavesNothing) {
  std::vector<double> noise(40000);
  for (size_t i = 0; i < noise.size(); ++i) noise[i] = std::sin(static_cast<double>(i * i) * 0.37);
  for (const rlim_t limit : {1000, 50000, 150000}) {
    const FileSizeLimit full(limit);
    const std::string said = error_of<WorkError>([&] {
      h5::File file = h5::File::create(dir / "x.h5");
      h5::Dataset set = file.create_appendable<double>("/rows", {40000});
      for (int i = 0; i < 4; ++i) set.append<double>(noise);
      file.commit();
    });
    EXPECT_HAS(said, "x.h5: could not be written (File too large)");
  }
  EXPECT_TRUE(names_in(dir.path()).empty());
  // The library is still usable.
  write_one(dir / "y.h5", "/x", {40000}, noise);
  EXPECT_EQ(h5::File::open(dir / "y.h5").read<double>("/x", {-1}), noise);
}

}  // namespace
}  // namespace restage
