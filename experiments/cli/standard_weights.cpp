#include "experiments/cli/standard_weights.h"

#include <dlfcn.h>

#include <filesystem>

#include "autograd/base/error.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

/// The file that holds this function: the program, or the module that Python has loaded.
fs::path own_file() {
  Dl_info found{};
  const bool known = dladdr(reinterpret_cast<const void*>(&standard_weights), &found) != 0;
  return known && found.dli_fname != nullptr ? found.dli_fname : "";
}

}  // namespace

std::string standard_weights() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path module = own_file().parent_path();
  const std::string name = "standard.safetensors", sources = "experiments/weights/" + name;
  for (const fs::path& place :
       {program / name, program / "../share/restage" / name, program / "../.." / sources,
        module / name, module / "../../../../share/restage" / name,
        module / "../../../.." / sources}) {
    const fs::path file = fs::weakly_canonical(place, error);
    if (!error && fs::is_regular_file(file, error)) return file.string();
  }
  throw InputError("", "--weights is missing, and the standard weights are not beside the program",
                   "give a weights file or a run");
}

}  // namespace restage::cli
