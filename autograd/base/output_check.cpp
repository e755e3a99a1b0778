#include "autograd/base/output_check.h"

#include <filesystem>

#include "autograd/base/error.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Whether `path` lies somewhere below the folder `out`.
bool lies_in(const fs::path& out, const std::string& path) {
  std::error_code failed;
  fs::path above = fs::canonical(path, failed);
  while (!failed && above.has_relative_path()) {
    above = above.parent_path();
    if (fs::equivalent(above, out, failed)) return true;
  }
  return false;
}

}  // namespace

void check_output(const std::string& out, const std::vector<std::string>& inputs) {
  std::error_code ignored;
  if (!fs::exists(out, ignored)) return;
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    if (fs::equivalent(out, input, ignored))
      throw InputError(out, "is one of the inputs and would be overwritten", "write to another");
    if (fs::is_directory(out, ignored) && lies_in(out, input))
      throw InputError(out, "holds '" + input + "', one of the inputs, and would be overwritten",
                       "write to another");
  }
}

}  // namespace restage
