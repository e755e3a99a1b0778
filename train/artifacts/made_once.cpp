#include "train/artifacts/made_once.h"

#include <chrono>
#include <filesystem>
#include <thread>
#include <vector>

#include "autograd/base/log.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> leftovers(const std::string& dir, const std::string& name) {
  std::vector<fs::path> out;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(dir, ignored)) {
    const std::string file = entry.path().filename().string();
    const bool draft = file.starts_with(".") || file.find(".part") != std::string::npos;
    if (draft && file.find(name) != std::string::npos) out.push_back(entry.path());
  }
  return out;
}

}  // namespace

std::string path_aside(const std::string& dir, const std::string& name, const char* suffix) {
  return (fs::path(dir) / ("." + name + suffix)).string();
}

bool made_once_detail::has_leftovers(const std::string& dir, const std::string& name) {
  return !leftovers(dir, name).empty();
}

/// Removes all leftovers but the lease, which the caller holds.
void made_once_detail::remove_leftovers(const std::string& dir, const std::string& name) {
  std::error_code ignored;
  for (const fs::path& path : leftovers(dir, name))
    if (path.filename().string().find(".lease") == std::string::npos) fs::remove_all(path, ignored);
}

void made_once_detail::wait(const std::string& dir, const std::string& name, bool told) {
  if (!told) {
    const auto holder = Lease::holder(path_aside(dir, name, ".lease"));
    log_info("waiting for " + name + (holder ? ", which " + holder->text() + " makes" : ""));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  throw_if_stopped();
}

}  // namespace restage
