#include "autograd/base/output_check.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "autograd/base/atomic_file.h"
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

/// Whoever may not write there is told before any work. Links are followed later.
void check_folder(const std::string& out) {
  std::error_code ignored;
  if (out.empty() || fs::is_symlink(out, ignored)) return;
  const fs::path path = out.back() == '/' ? fs::path(out).parent_path() : fs::path(out);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (!fs::is_directory(folder, ignored)) return;
  if (faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0 &&
      (errno == EACCES || errno == EROFS))
    throw_unwritable(out, errno);
}

}  // namespace

void check_output(const std::string& out, const std::vector<std::string>& inputs) {
  check_folder(out);
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
