// Checksums that are kept: never of another content than the file's.
#include "datasets/readers/file_sums.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/sha256.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"

namespace restage {
namespace {

using namespace test;

/// A cache of its own, and a file that is large enough to be kept.
class FileSums : public FileTest {
 protected:
  FileSums() {
    if (const char* value = std::getenv("XDG_CACHE_HOME")) before_ = value;
    ::setenv("XDG_CACHE_HOME", (dir / "cache").c_str(), 1);
    dir.write("data.h5", content_);
  }
  ~FileSums() override {
    before_.empty() ? ::unsetenv("XDG_CACHE_HOME") : ::setenv("XDG_CACHE_HOME", before_.c_str(), 1);
  }
  static void let_it_age() { std::this_thread::sleep_for(std::chrono::milliseconds(2100)); }
  bool is_kept() const { return std::filesystem::exists(cache_); }
  /// Makes the cache say another sum, with everything else as it should be.
  void forge() const {
    std::string line = bytes_of(cache_);
    line = replaced(line.substr(0, line.size() - 1), sha256(content_), other_);
    write_bytes(cache_, checksum(line.substr(17)) + line.substr(16) + "\n");
  }

  std::string content_ = std::string(size_t{9} << 20, 'a');
  const std::string path_ = dir / "data.h5", cache_ = dir / "cache/restage/sums",
                    other_ = std::string(64, '0');

 private:
  std::string before_;
};

TEST_F(FileSums, AreTakenFromTheCacheWhileTheFileIsAsItWas) {
  EXPECT_EQ(kept_sha256(path_), sha256(content_));
  EXPECT_FALSE(is_kept()) << "it was written just now";
  let_it_age();
  EXPECT_EQ(kept_sha256(path_), sha256(content_));
  ASSERT_TRUE(is_kept());
  forge();
  EXPECT_EQ(kept_sha256(path_), other_) << "the file is not read again";
  // The same size and the same time: as a tool leaves it that puts times back.
  struct stat info {};
  ASSERT_EQ(::stat(path_.c_str(), &info), 0);
  content_[5] = 'b';
  write_bytes(path_, content_);
  const timespec times[] = {info.st_atim, info.st_mtim};
  ASSERT_EQ(::utimensat(AT_FDCWD, path_.c_str(), times, 0), 0);
  EXPECT_EQ(kept_sha256(path_), sha256(content_));
}

TEST_F(FileSums, OfAnotherFileUnderTheNameAreComputed) {
  let_it_age();
  kept_sha256(path_);
  content_ += "b";
  dir.write("new.h5", content_);
  std::filesystem::rename(dir / "new.h5", path_);
  EXPECT_EQ(kept_sha256(path_), sha256(content_));
}

TEST_F(FileSums, ADamagedCacheIsNotBelieved) {
  let_it_age();
  kept_sha256(path_);
  const std::string good = bytes_of(cache_);
  std::vector<std::string> bad = {"",
                                  "\n\n",
                                  good.substr(0, good.size() / 2),
                                  "\xff\xfe",
                                  std::string(5 << 20, 'x'),
                                  good + good.substr(0, 40)};
  for (const size_t at : {size_t{0}, size_t{20}, size_t{90}, good.size() - 3}) {
    bad.push_back(good);
    bad.back()[at] = bad.back()[at] == '1' ? '2' : '1';
  }
  bad.push_back(replaced(good, sha256(content_), other_));
  for (const std::string& text : bad) {
    write_bytes(cache_, text);
    EXPECT_EQ(kept_sha256(path_), sha256(content_)) << text.substr(0, 100);
  }
  std::filesystem::remove_all(dir / "cache");
  write_bytes(dir / "cache", "no folder");
  EXPECT_EQ(kept_sha256(path_), sha256(content_));
}

TEST_F(FileSums, SmallFilesAreReadAndUnreadableOnesAreErrors) {
  dir.write("small.h5", "x");
  let_it_age();
  EXPECT_EQ(kept_sha256(dir / "small.h5"), sha256("x"));
  EXPECT_FALSE(is_kept());
  EXPECT_THROW(kept_sha256(dir / "absent.h5"), ReadError);
  kept_sha256(path_);
  const Unreadable loop(path_);
  EXPECT_THROW(kept_sha256(path_), ReadError);
}

}  // namespace
}  // namespace restage
