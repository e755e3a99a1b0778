// A temporary folder that goes with its content, also when a signal ends the program.
#pragma once

#include <string>

#include "autograd/base/temporary.h"

namespace restage {

class Scratch {
 public:
  /// WorkError if the system's temporary folder (TMPDIR) cannot be written to.
  Scratch();
  std::string file(const char* name) const { return folder() + "/" + name; }
  const std::string& folder() const { return folder_.path(); }

 private:
  Temporary folder_;
};

}  // namespace restage
