#include "autograd/base/shipped.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "autograd/base/error.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSelf = "/proc/self/exe";

/// The script that started the program, where a package brings a loader of its own (cmake/package):
/// the system then takes the loader for the program.
std::string launcher() {
  std::error_code error;
  const fs::path self = fs::read_symlink(kSelf, error);
  const char* by = std::getenv("RESTAGE_LAUNCHER");
  return by != nullptr && self.filename().string().starts_with("ld-") ? by : "";
}

/// The file that holds this function: the program, or the module that Python loaded.
fs::path own_file() {
  Dl_info found{};
  const bool known = dladdr(reinterpret_cast<const void*>(&shipped), &found) != 0;
  return known && found.dli_fname != nullptr ? found.dli_fname : "";
}

/// The program beside the module that Python loaded: installed, or in a build folder. Empty: this
/// is no module.
std::string beside_module() {
  const fs::path module = own_file();
  if (module.extension() != ".so") return "";
  for (const char* place : {"../../../../bin/restage", "../../restage"}) {
    std::error_code error;
    const fs::path program = fs::canonical(module.parent_path() / place, error);
    if (!error) return program.string();
  }
  throw WorkError("the program 'restage', which does this work, is not beside " + module.string());
}

}  // namespace

std::string program_to_start() {
  for (const std::string& other : {beside_module(), launcher()})
    if (!other.empty()) return other;
  return kSelf;
}

std::string own_program() {
  std::error_code error;
  const std::string by = launcher();
  const fs::path path = by.empty() ? fs::read_symlink(kSelf, error) : fs::canonical(by, error);
  return error ? "" : path.string();
}

std::string shipped(const std::string& name) {
  if (name.empty() || fs::path(name).is_absolute()) return "";
  const fs::path program = fs::path(own_program()).parent_path(), module = own_file().parent_path();
  // Installed; in a build folder of the clone; the same of the module for Python.
  for (const fs::path& root : {program / "../share/restage", program / "../..",
                               module / "../../../../share/restage", module / "../../../.."}) {
    std::error_code error;
    if (!fs::exists(root / "experiments/weights", error)) continue;  // some other folder
    const fs::path place = fs::weakly_canonical(root / name, error);
    if (!error && fs::exists(place, error)) return place.string();
  }
  return "";
}

std::string here_or_shipped(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error)) return path;
  const std::string found = shipped(path);
  return found.empty() ? path : found;
}

}  // namespace restage
