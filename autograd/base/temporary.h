// Files and folders that must not outlive the work on them.
#pragma once

#include <string>

namespace restage {

/// A name for work in progress beside a target: `prefix` + the target's name + ".part" + a
/// unique_token() (host.h). The target's name is shortened where the file system could not hold it
/// all. All drafts of files and folders are named so: ".part" tells what a killed process has left.
std::string name_beside(const std::string& target, const std::string& prefix = "");

/// The file or folder `path`, which the owner makes, is removed in the end unless keep() was
/// called, also when a signal ends the program (interrupt.h). A signal removes at most 64 of them.
class Temporary {
 public:
  explicit Temporary(std::string path);
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  const std::string& path() const { return path_; }
  void keep();  ///< the file is to stay: it has got another name

 private:
  std::string path_;
  int slot_ = -1;
};

/// Removes all temporaries that exist. Makes only calls that a signal handler may make.
void remove_temporaries() noexcept;

}  // namespace restage
