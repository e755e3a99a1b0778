// A temporary folder that goes with its content.
#pragma once

#include <filesystem>
#include <string>

namespace restage {

class Scratch {
 public:
  /// WorkError if the system's temporary folder (TMPDIR) cannot be written to.
  Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch();
  std::string file(const char* name) const { return (path_ / name).string(); }
  std::string folder() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace restage
