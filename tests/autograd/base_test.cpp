// The base library; and that the include directions of docs/design/architecture.md hold.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <set>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "autograd/base/inline_vector.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/rng.h"
#include "autograd/base/thread_groups.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"
#include "tests/support/lacking.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using AtomicFiles = FileTest;

TEST_F(AtomicFiles, AppearWholeAndReadBack) {
  const std::string text("a\0b\n", 4);
  write_file_atomically(dir / "x", text);
  EXPECT_EQ(read_file(dir / "x"), text);
  write_file_atomically(dir / "x", "");
  EXPECT_EQ(read_file(dir / "x"), "");
  EXPECT_EQ(names_in(dir.path()).size(), 1u);
}

TEST_F(AtomicFiles, WithoutCommitLeaveNothingAndKeepTheOld) {
  write_file_atomically(dir / "x", "old");
  {
    const AtomicFile file(dir / "x");
    std::ofstream(file.path()) << "half";
    EXPECT_EQ(read_file(dir / "x"), "old");
    EXPECT_EQ(names_in(dir.path()).size(), 2u);
  }
  EXPECT_EQ(read_file(dir / "x"), "old");
  EXPECT_EQ(names_in(dir.path()).size(), 1u);
}

TEST_F(AtomicFiles, NameTheTargetThatCannotBeWritten) {
  for (const std::string& bad : {dir / "no/such/folder/x", dir.path()})
    expect_error<InputError>([&] { write_file_atomically(bad, "x"); }, {bad});
}

TEST_F(AtomicFiles, AFullDiskIsAWorkError) {
  const FileSizeLimit full(50000);
  expect_error<WorkError>([&] { write_file_atomically(dir / "x", std::string(100000, 'x')); },
                          {dir / "x" + ": ", "free some space"});
  EXPECT_EQ(names_in(dir.path()).size(), 0u);
}

TEST_F(AtomicFiles, NoTwoDraftsHaveOneName) {
  const AtomicFile one(dir / "x"), other(dir / "x");
  EXPECT_NE(one.path(), other.path()) << "of two threads, or of two machines on one disk";
  for (const AtomicFile* file : {&one, &other}) EXPECT_HAS(file->path(), dir / "x.part");
}

TEST_F(AtomicFiles, LeadThroughLinksAndLeavePipesAlone) {
  fs::create_symlink("x", dir / "link");
  write_file_atomically(dir / "link", "new");
  EXPECT_TRUE(fs::is_symlink(dir / "link"));
  EXPECT_EQ(read_file(dir / "x"), "new");
  ASSERT_EQ(::mkfifo((dir / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_file_atomically(dir / "pipe", "x"), InputError);
  EXPECT_TRUE(fs::is_fifo(dir / "pipe"));
  EXPECT_THROW(read_file(dir / "pipe"), InputError);
}

TEST_F(AtomicFiles, NamesMayBeAsLongAsTheFileSystemHolds) {
  const std::string longest(255, 'x');
  write_file_atomically(dir / longest, "1");
  EXPECT_EQ(read_file(dir / longest), "1");
  EXPECT_THROW(write_file_atomically(dir / longest + "x", "1"), InputError);
}

TEST_F(AtomicFiles, ASignalRemovesWhatIsUnderWay) {
  write_file_atomically(dir / "kept", "1");
  const AtomicFile file(dir / "kept");
  const Temporary folder(dir / "folder");
  fs::create_directories(dir / "folder/a/b");
  for (const char* name : {"folder/1", "folder/a/2", "folder/a/b/3"}) std::ofstream(dir / name);
  fs::create_directory_symlink(dir / "kept", dir / "folder/link");
  {
    Temporary other(dir / "other");
    std::ofstream(dir / "other");
    other.keep();
  }
  remove_temporaries();
  EXPECT_EQ(names_in(dir.path()).size(), 2u);  // "kept" and "other"
  EXPECT_EQ(read_file(dir / "kept"), "1");
}

TEST_F(AtomicFiles, OutputsMustNotLieOverInputs) {
  fs::create_directories(dir / "folder/in");
  write_file_atomically(dir / "folder/in/x", "1");
  fs::create_hard_link(dir / "folder/in/x", dir / "twin");
  fs::create_symlink(dir / "folder/in", dir / "link");
  const std::string x = dir / "folder/in/x";
  for (const std::string& out : {x, dir / "twin", dir / "link" + "/x", dir / "folder", dir / "link",
                                 dir / "folder/../folder/in/x", dir / "folder/"})
    EXPECT_THROW(check_output(out, {"", dir / "missing", x}), InputError) << out;
  EXPECT_THROW(check_output(dir / "link", {dir / "folder/in"}), InputError);
  fs::create_directory(dir / "folder/other");
  for (const std::string& out :
       {dir / "new", dir / "folder/in/new", dir / "folder/other", std::string()})
    EXPECT_NO_THROW(check_output(out, {x, dir / "folder"})) << out;
}

TEST_F(AtomicFiles, AFolderThatIsClosedIsSaidBeforeAnyWork) {
  const std::string closed = dir / "closed";
  fs::create_directory(closed);
  fs::permissions(closed, fs::perms(0555));
  fs::permissions(dir.path(), fs::perms(0755));
  const bool root = geteuid() == 0;  // to whom no folder is closed
  if (root) {
    EXPECT_NO_THROW(check_output(closed + "/new", {}));
    ASSERT_EQ(seteuid(65534), 0);
  }
  const std::string said = test::refusal_of([&] { check_output(closed + "/new", {}); });
  const std::string of_a_folder = test::refusal_of([&] { check_output(closed + "/new/", {}); });
  if (root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_HAS(said, "closed/new");
  EXPECT_HAS(of_a_folder, "closed/new");
  fs::permissions(closed, fs::perms::owner_all);
}

TEST_F(AtomicFiles, ReadingHasLimits) {
  write_file_atomically(dir / "x", "12345");
  EXPECT_EQ(read_file(dir / "x", 5), "12345");
  EXPECT_THROW(read_file(dir / "x", 4), InputError);
  EXPECT_THROW(read_file(dir / "missing"), InputError);
  EXPECT_THROW(read_file(dir.path()), InputError);
}

TEST(BaseSettingNames, AreWrittenAsWhoShowsTheMessageSays) {
  EXPECT_EQ(spelled("give {max-memory}, or leave {up} out"), "give max_memory, or leave up out");
  const std::string no_names = "a {, {} and {A} or {1: x}, {open";
  EXPECT_EQ(spelled(no_names), no_names);
  const InputError error("{up}.ply", "lies", "give {source-up}");
  EXPECT_STREQ(error.what(), "{up}.ply: lies; give source_up") << "names of files stay";
  EXPECT_EQ(error.mend(), "give source_up");
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
  for (const int t : {1, 2, 3}) {
    const testing::UseThreads use(t);
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
}

TEST(ParallelFor, NestsAndPassesErrorsOn) {
  const testing::UseThreads use(3);
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
}

TEST(ThreadGroups, ShareTheThreadsAndTakeEveryItemOnce) {
  for (const int all : {1, 2, 5}) {
    const testing::UseThreads use(all);
    for (const int groups : {1, 2, 9}) {
      std::vector<std::atomic<int>> hits(7);
      std::atomic<int64_t> inner{0};
      in_groups(7, groups, [&](int64_t i) {
        ++hits[static_cast<size_t>(i)];
        const int own = threads(), many = std::min(groups, all);
        EXPECT_GE(own, all / many);
        EXPECT_LE(own, (all + many - 1) / many);
        parallel_for(100, 1, [&](int64_t from, int64_t to) { inner += to - from; });
      });
      EXPECT_EQ(inner, 700);
      for (const auto& h : hits) ASSERT_EQ(h, 1);
      EXPECT_EQ(threads(), all) << "outside of a group nothing has changed";
    }
  }
  in_groups(0, 3, [](int64_t) { FAIL(); });
}

TEST(ThreadGroups, PassErrorsOn) {
  const testing::UseThreads use(2);
  std::atomic<int> done{0};
  EXPECT_THROW(in_groups(4, 2,
                         [&](int64_t i) {
                           if (i == 1) throw WorkError("item 1");
                           ++done;
                         }),
               WorkError);
  EXPECT_EQ(done, 2) << "the other group goes on to its end";
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

using LogFiles = FileTest;

TEST_F(LogFiles, MayBeChangedWhileOtherThreadsWrite) {
  set_log_level(LogLevel::quiet);
  std::atomic<bool> done = false;
  std::vector<std::thread> writers;
  for (int i = 0; i < 3; ++i)
    writers.emplace_back([&] {
      while (!done) log_info("a line");
    });
  for (int i = 0; i < 500; ++i) {
    set_log_file(dir / (i % 2 == 0 ? "even" : "odd"));
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  done = true;
  for (std::thread& writer : writers) writer.join();
  set_log_file(dir / "last");
  log_info("to the last");
  set_log_file("");
  log_info("to none");
  set_log_level(LogLevel::info);
  size_t lines = 0;
  for (const char* name : {"even", "odd"}) {
    std::istringstream text(read_file(dir / name));
    for (std::string line; std::getline(text, line); ++lines)
      ASSERT_EQ(line.substr(19), " a line") << "after date and time";
  }
  EXPECT_GT(lines, 0u);
  EXPECT_EQ(read_file(dir / "last").substr(19), " to the last\n");
}

/// Exit code of the script for a source tree, -1 if there is no Python.
int check_layers(const std::string& root, const std::string& output = "") {
  if (std::system("python3 -c pass > /dev/null 2>&1") != 0) return -1;
  const std::string command =
      "python3 '" RESTAGE_SOURCE_DIR "/cmake/check_layers.py' '" + root + "'" + output;
  return WEXITSTATUS(std::system(command.c_str()));
}

TEST(Layers, PointOneWay) {
  const int code = check_layers(RESTAGE_SOURCE_DIR);
  if (code < 0) RESTAGE_LACKS("python3 is missing");
  EXPECT_EQ(code, 0) << "see the lines above; the rule is in docs/design/architecture.md";
}

TEST(Layers, ABrokenArrowIsSeen) {
  const auto with = [](const std::string& file, const std::string& line) {
    const test::TempDir root;
    root.write(file, line + "\n");
    return check_layers(root.path(), " > /dev/null");
  };
  const int fine = with("autograd/ops/x.h", "#include \"autograd/tape/tape.h\"");
  if (fine < 0) RESTAGE_LACKS("python3 is missing");
  EXPECT_EQ(fine, 0);
  EXPECT_EQ(with("train/stages/x.cpp", "#include \"datasets/schema.h\""), 0);
  EXPECT_EQ(with("autograd/tape/x.h", "#include \"autograd/ops/reduce.h\""), 1);
  EXPECT_EQ(with("autograd/ops/x.cpp", "#include \"autograd/cpu/pool.h\""), 1);
  EXPECT_EQ(with("train/trainer.cpp", "#include \"datasets/schema.h\""), 1);
  EXPECT_EQ(with("train/artifacts/x.h", "#include \"train/stages/registry.h\""), 1);
  EXPECT_EQ(with("train/stages/x.h", "#include \"train/training/train_config.h\""), 1);
  EXPECT_EQ(with("infer/x.cpp", "#include \"train/run.h\""), 1);
  EXPECT_EQ(with("nn/models/x.cpp", "#include \"train/run.h\""), 1);
  EXPECT_EQ(with("nn/models/x.cpp", "#include <tbb/parallel_for.h>"), 1);
  EXPECT_EQ(with("train/x.h", "#include <nlohmann/json_fwd.hpp>"), 1);
  EXPECT_EQ(with("train/x.cpp", "#include <nlohmann/json.hpp>"), 0);
  EXPECT_EQ(with("autograd/unknown/x.cpp", "#include \"autograd/base/rng.h\""), 1);
}

}  // namespace
}  // namespace restage
