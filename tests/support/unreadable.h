// Files that are good and cannot be read: for tests of what is made of such errors. Permissions
// would not do, which root does not need.
#pragma once

#include <sys/resource.h>

#include <filesystem>
#include <string>

namespace restage::test {

/// False under the sanitizers: UBSan opens a pipe to look at an object of a class that it has not
/// met, and takes a failure for a fault of ours.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define RESTAGE_FILES_MAY_RUN_OUT false
#endif
#endif
#ifndef RESTAGE_FILES_MAY_RUN_OUT
#define RESTAGE_FILES_MAY_RUN_OUT true
#endif

/// While it lives, no further file can be opened ("Too many open files").
class NoMoreFiles {
 public:
  NoMoreFiles() {
    getrlimit(RLIMIT_NOFILE, &old_);
    const rlimit none{0, old_.rlim_max};
    setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoMoreFiles() { setrlimit(RLIMIT_NOFILE, &old_); }
  NoMoreFiles(const NoMoreFiles&) = delete;
  NoMoreFiles& operator=(const NoMoreFiles&) = delete;

 private:
  rlimit old_{};
};

/// While it lives, the file at `path` cannot be found or read: a link that leads to itself lies in
/// its place ("Too many levels of symbolic links"). In the end the file is there again.
class Unreadable {
 public:
  explicit Unreadable(std::string path) : path_(std::move(path)) {
    std::filesystem::rename(path_, path_ + ".good");
    std::filesystem::create_symlink(path_, path_);
  }
  ~Unreadable() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);  // no folder can take the place of a link
    std::filesystem::rename(path_ + ".good", path_, ignored);
  }
  Unreadable(const Unreadable&) = delete;
  Unreadable& operator=(const Unreadable&) = delete;

 private:
  std::string path_;
};

}  // namespace restage::test
