#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/inline_vector.h"
#include "autograd/base/output_check.h"
#include "autograd/base/parallel.h"
#include "autograd/base/rng.h"
#include "tests/support/lacking.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

class AtomicFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "restage-base-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  size_t entries() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
  fs::path folder_;
};

TEST_F(AtomicFiles, AppearWholeAndReadBack) {
  const std::string text("a\0b\n", 4);
  write_file_atomically(at("x"), text);
  EXPECT_EQ(read_file(at("x")), text);
  write_file_atomically(at("x"), "");
  EXPECT_EQ(read_file(at("x")), "");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFiles, WithoutCommitLeaveNothingAndKeepTheOld) {
  write_file_atomically(at("x"), "old");
  {
    const AtomicFile file(at("x"));
    std::ofstream(file.path()) << "half";
    EXPECT_EQ(read_file(at("x")), "old");
    EXPECT_EQ(entries(), 2u);
  }
  EXPECT_EQ(read_file(at("x")), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFiles, NameTheTargetThatCannotBeWritten) {
  for (const std::string& bad : {at("no/such/folder/x"), folder_.string()}) {
    try {
      write_file_atomically(bad, "x");
      ADD_FAILURE() << bad << " was written";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(bad), std::string::npos) << error.what();
      EXPECT_EQ(error.exit_code, 2);
    }
  }
}

TEST_F(AtomicFiles, AFullDiskIsAWorkError) {
  if (!fs::exists("/dev/full")) RESTAGE_LACKS("there is no /dev/full here");
  // The temporary file of this process, already there as a link to the full device.
  fs::create_symlink("/dev/full", at("x") + ".part" + std::to_string(::getpid()));
  try {
    write_file_atomically(at("x"), std::string(100000, 'x'));
    ADD_FAILURE() << "a full disk went unnoticed";
  } catch (const WorkError& error) {
    EXPECT_EQ(error.exit_code, 1);
    EXPECT_NE(std::string(error.what()).find(at("x") + ": "), std::string::npos) << error.what();
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFiles, LeadThroughLinksAndLeavePipesAlone) {
  fs::create_symlink("x", at("link"));
  write_file_atomically(at("link"), "new");
  EXPECT_TRUE(fs::is_symlink(at("link")));
  EXPECT_EQ(read_file(at("x")), "new");
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_file_atomically(at("pipe"), "x"), InputError);
  EXPECT_TRUE(fs::is_fifo(at("pipe")));
  EXPECT_THROW(read_file(at("pipe")), InputError);
}

TEST_F(AtomicFiles, NamesMayBeAsLongAsTheFileSystemHolds) {
  const std::string longest(255, 'x');
  write_file_atomically(at(longest), "1");
  EXPECT_EQ(read_file(at(longest)), "1");
  EXPECT_THROW(write_file_atomically(at(longest + "x"), "1"), InputError);
}

TEST_F(AtomicFiles, ASignalRemovesWhatIsUnderWay) {
  write_file_atomically(at("kept"), "1");
  const AtomicFile file(at("kept"));
  const Temporary folder(at("folder"));
  fs::create_directories(at("folder/a/b"));
  for (const char* name : {"folder/1", "folder/a/2", "folder/a/b/3"}) std::ofstream(at(name));
  fs::create_directory_symlink(folder_ / "kept", at("folder/link"));
  {
    Temporary other(at("other"));
    std::ofstream(at("other"));
    other.keep();
  }
  remove_temporaries();
  EXPECT_EQ(entries(), 2u);  // "kept" and "other"
  EXPECT_EQ(read_file(at("kept")), "1");
}

TEST_F(AtomicFiles, OutputsMustNotLieOverInputs) {
  fs::create_directories(at("folder/in"));
  write_file_atomically(at("folder/in/x"), "1");
  fs::create_hard_link(at("folder/in/x"), at("twin"));
  fs::create_symlink(at("folder/in"), at("link"));
  const std::string x = at("folder/in/x");
  for (const std::string& out : {x, at("twin"), at("link") + "/x", at("folder"), at("link"),
                                 at("folder/../folder/in/x"), at("folder/")})
    EXPECT_THROW(check_output(out, {"", at("missing"), x}), InputError) << out;
  EXPECT_THROW(check_output(at("link"), {at("folder/in")}), InputError);
  fs::create_directory(at("folder/other"));
  for (const std::string& out : {at("new"), at("folder/in/new"), at("folder/other"), std::string()})
    EXPECT_NO_THROW(check_output(out, {x, at("folder")})) << out;
}

TEST_F(AtomicFiles, ReadingHasLimits) {
  write_file_atomically(at("x"), "12345");
  EXPECT_EQ(read_file(at("x"), 5), "12345");
  EXPECT_THROW(read_file(at("x"), 4), InputError);
  EXPECT_THROW(read_file(at("missing")), InputError);
  EXPECT_THROW(read_file(folder_.string()), InputError);
}

TEST(Checksums, SeeEverySingleByte) {
  std::string text(37, 'a');
  std::set<std::string> seen{checksum(text)};
  for (char& c : text) {
    c = 'b';
    EXPECT_TRUE(seen.insert(checksum(text)).second);
    c = 'a';
  }
  EXPECT_EQ(checksum(text), *seen.find(checksum(text)));
  for (size_t n = 0; n < 37; ++n) EXPECT_TRUE(seen.insert(checksum(text.substr(0, n))).second);
  EXPECT_EQ(checksum("").size(), 16u);
}

TEST(InlineVector, HoldsValuesUpToItsSize) {
  const auto value = std::make_shared<int>(7);
  using Three = InlineVector<std::shared_ptr<int>, 3>;
  {
    Three a = {value, value};
    EXPECT_EQ(a.size(), 2u);
    EXPECT_EQ(value.use_count(), 3);
    Three b = a;
    b.push_back(nullptr);
    EXPECT_EQ(value.use_count(), 5);
    EXPECT_THROW(b.push_back(value), Error);
    EXPECT_EQ(b.size(), 3u);
    a = b;
    EXPECT_EQ(a[0], value);
    EXPECT_EQ(a[2], nullptr);
    EXPECT_EQ(std::count(a.begin(), a.end(), value), 2);
    b.clear();
    EXPECT_EQ(value.use_count(), 3);
  }
  EXPECT_EQ(value.use_count(), 1);
}

TEST(ParallelFor, CoversEveryItemOnceForOddSizes) {
  const int before = threads();
  for (const int t : {1, 2, 3}) {
    set_threads(t);
    for (const int64_t n : {0, 1, 2, 7, 64, 1001})
      for (const int64_t grain : {0, 1, 3, 64, 5000}) {
        std::vector<std::atomic<int>> hits(static_cast<size_t>(n));
        parallel_for(n, grain, [&](int64_t from, int64_t to) {
          EXPECT_LT(from, to);
          EXPECT_LE(to - from, std::max<int64_t>(1, grain));
          EXPECT_EQ(from % std::max<int64_t>(1, grain), 0);
          for (int64_t i = from; i < to; ++i) ++hits[static_cast<size_t>(i)];
        });
        for (const auto& h : hits) ASSERT_EQ(h, 1) << n << " " << grain << " " << t;
      }
  }
  set_threads(before);
}

TEST(ParallelFor, NestsAndPassesErrorsOn) {
  const int before = threads();
  set_threads(3);
  std::atomic<int> count{0};
  parallel_for(10, 1, [&](int64_t, int64_t) {
    parallel_for(10, 1, [&](int64_t from, int64_t to) { count += static_cast<int>(to - from); });
  });
  EXPECT_EQ(count, 100);
  EXPECT_THROW(parallel_for(100, 1,
                            [](int64_t from, int64_t) {
                              if (from == 57) throw WorkError("piece 57");
                            }),
               WorkError);
  set_threads(before);
}

TEST(Random, PhiloxGivesThePublishedNumbers) {
  // Known answers of Random123 for philox4x32-10: counter (4 words), key (2 words), result.
  const struct {
    uint64_t index, stream, seed;
    std::array<uint32_t, 4> words;
  } known[] = {
      {0, 0, 0, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
      {~0ull, ~0ull, ~0ull, {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
      {0x85a308d3243f6a88,
       0x0370734413198a2e,
       0x299f31d0a4093822,
       {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
  };
  for (const auto& k : known) EXPECT_EQ(philox({k.seed, k.stream}, k.index), k.words);
}

TEST(Random, NumbersHaveTheirDistribution) {
  constexpr int n = 200000;
  const RngKey key{3, 4};
  double sum = 0, squares = 0, normals = 0, normal_squares = 0;
  std::array<int, 7> counts{};
  for (uint64_t i = 0; i < n; ++i) {
    const double u = uniform(key, i), z = normal(key.fold(1), i);
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
    normals += z;
    normal_squares += z * z;
    ++counts.at(uniform_int(key.fold(2), i, 7));
  }
  EXPECT_NEAR(sum / n, 0.5, 0.003);
  EXPECT_NEAR(squares / n, 1.0 / 3, 0.003);
  EXPECT_NEAR(normals / n, 0, 0.01);
  EXPECT_NEAR(normal_squares / n, 1, 0.015);
  for (const int c : counts) EXPECT_NEAR(c, n / 7, 800);
}

TEST(Random, StreamsDifferAndRepeat) {
  const RngKey key{1, 0};
  std::set<uint64_t> streams;
  for (uint64_t i = 0; i < 1000; ++i) streams.insert(key.fold(i).stream);
  streams.insert(key.fold("dropout").stream);
  streams.insert(key.fold("noise").stream);
  EXPECT_EQ(streams.size(), 1002u);
  Rng a(key.fold("x")), b(key.fold("x")), c(key.fold("y"));
  const double first = a.uniform();
  EXPECT_EQ(first, b.uniform());
  EXPECT_NE(first, c.uniform());
  EXPECT_NE(first, a.uniform());
}

TEST(Errors, CarryTheirExitCodes) {
  EXPECT_EQ(InputError("f.ply", "is bad", "mend it").exit_code, 2);
  EXPECT_STREQ(InputError("f.ply", "is bad", "mend it").what(), "f.ply: is bad; mend it");
  EXPECT_STREQ(InputError("", "is bad", "mend it").what(), "is bad; mend it");
  EXPECT_EQ(WorkError("x").exit_code, 1);
  EXPECT_EQ(ShapeError("x").exit_code, 1);
  EXPECT_EQ(NonFiniteError("x").exit_code, 1);
}

}  // namespace
}  // namespace restage
