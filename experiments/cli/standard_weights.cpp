#include "experiments/cli/standard_weights.h"

#include <filesystem>

#include "autograd/base/error.h"

namespace restage::cli {

std::string standard_weights() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* place : {"standard.safetensors", "../share/restage/standard.safetensors",
                            "../../experiments/weights/standard.safetensors"}) {
    const fs::path file = fs::weakly_canonical(folder / place, error);
    if (!error && fs::is_regular_file(file, error)) return file.string();
  }
  throw InputError("", "--weights is missing, and the standard weights are not beside the program",
                   "give a weights file or a run");
}

}  // namespace restage::cli
