// Files and folders that must not outlive the work on them.
#pragma once

#include <string>

namespace restage {

/// A name for work in progress beside a target: `prefix` + the target's name + ".part" + a
/// unique_token() (host.h). The target's name is shortened where the file system could not hold it
/// all. All drafts of files and folders are named so: ".part" tells what a killed process has left.
std::string name_beside(const std::string& target, const std::string& prefix = "");

/// The file or folder `path`, which the owner makes, is removed in the end unless it was kept, also
/// when a signal ends the program (interrupt.h). Of more than 64 at a time a signal leaves the
/// rest.
class Temporary {
 public:
  explicit Temporary(std::string path);
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  const std::string& path() const { return path_; }
  void keep();  ///< it has another name by now

 private:
  std::string path_;
  int slot_ = -1;
};

/// Removes all that there are. Only calls that a signal handler may make.
void remove_temporaries() noexcept;

}  // namespace restage
