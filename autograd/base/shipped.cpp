#include "autograd/base/shipped.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "autograd/base/error.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSelf = "/proc/self/exe";
constexpr const char* kMissing = "no program";  // what is beside a module that stands alone

/// The script that started the program, where a package brings a loader of its own (cmake/package):
/// the system then takes the loader for the program.
std::string launcher() {
  std::error_code error;
  const fs::path self = fs::read_symlink(kSelf, error);
  const char* by = std::getenv("RESTAGE_LAUNCHER");
  if (by == nullptr || !self.filename().string().starts_with("ld-")) return "";
  const fs::path path = fs::canonical(by, error);
  return error ? "" : path.string();
}

/// The file that holds this function: the program, the module that Python loaded, or the shared
/// library.
fs::path own_file() {
  Dl_info found{};
  const bool known = dladdr(reinterpret_cast<const void*>(&shipped), &found) != 0;
  return known && found.dli_fname != nullptr ? found.dli_fname : "";
}

/// The program beside the module that Python loaded or the shared library: installed, or in a build
/// folder. Empty: this is neither.
std::string beside_module() {
  const fs::path module = own_file();
  if (module.filename().string().find(".so") == std::string::npos) return "";
  for (const char* place :
       {"../../../../bin/restage", "../../restage", "../../bin/restage", "restage"}) {
    std::error_code error;
    const fs::path program = fs::canonical(module.parent_path() / place, error);
    if (!error) return program.string();
  }
  return kMissing;
}

std::vector<std::string>& words_that_were_set() {
  static std::vector<std::string> words;
  return words;
}

}  // namespace

void set_program_to_start(std::vector<std::string> words) {
  words_that_were_set() = std::move(words);
}

std::vector<std::string> words_to_start() {
  const std::vector<std::string>& set = words_that_were_set();
  return set.empty() ? std::vector{program_to_start()} : set;
}

std::string program_to_start() {
  const std::string module = beside_module(), by = launcher();
  if (module == kMissing)
    throw WorkError("the program 'restage', which does this work, is not beside the module " +
                    own_file().string());
  return !module.empty() ? module : !by.empty() ? by : kSelf;
}

std::string own_program() {
  std::error_code error;
  for (const std::string& other : {beside_module(), launcher()})
    if (!other.empty()) return other == kMissing ? "" : other;
  const fs::path path = fs::read_symlink(kSelf, error);
  return error ? "" : path.string();
}

std::string shipped(const std::string& name) {
  if (name.empty() || fs::path(name).is_absolute() || name.find("..") != std::string::npos)
    return "";
  const fs::path program = fs::path(own_program()).parent_path(), module = own_file().parent_path();
  // Installed; in a build folder of the clone; the same of the module for Python; the shared
  // library.
  for (const fs::path& root :
       {program / "../share/restage", program / "../..", module / "../../../../share/restage",
        module / "../../../..", module / "../../share/restage"}) {
    std::error_code error;
    if (root.is_relative() || !fs::exists(root / "experiments/weights", error)) continue;
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
