#include "experiments/scratch.h"

#include <stdlib.h>

#include "autograd/base/error.h"

namespace restage {

namespace fs = std::filesystem;

Scratch::Scratch() {
  std::string name = (fs::temp_directory_path() / "restage-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw WorkError(name + ": could not be made; give TMPDIR a folder that you can write to");
  path_ = name;
}

Scratch::~Scratch() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace restage
