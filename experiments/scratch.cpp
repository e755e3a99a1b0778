#include "experiments/scratch.h"

#include <sys/stat.h>

#include <filesystem>

#include "autograd/base/error.h"

namespace restage {
namespace {

std::string fresh_name() {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::temp_directory_path(error);
  if (error)
    throw WorkError("there is no folder for temporary files; give TMPDIR one that is there");
  return name_beside((root / "restage").string());
}

}  // namespace

Scratch::Scratch() : folder_(fresh_name()) {
  if (::mkdir(folder().c_str(), 0700) != 0)
    throw WorkError(folder() + ": could not be made; give TMPDIR a folder that you can write to");
}

}  // namespace restage
