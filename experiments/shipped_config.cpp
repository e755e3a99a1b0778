#include "experiments/shipped_config.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "autograd/base/shipped.h"

namespace restage {

namespace fs = std::filesystem;

std::vector<std::string> shipped_configs() {
  std::vector<std::string> out;
  const std::string folder = shipped("configs");
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error))
    if (it->path().extension() == ".yaml" && it->path().parent_path().filename() != "data")
      out.push_back(it->path().lexically_relative(folder).replace_extension().string());
  std::sort(out.begin(), out.end());
  return out;
}

std::string shipped_config(const std::string& name) {
  std::error_code error;
  for (const char* folder : {"", "configs"})
    for (const char* ending : {"", ".yaml"}) {
      const std::string found = shipped((fs::path(folder) / (name + ending)).string());
      if (fs::is_regular_file(found, error)) return found;
    }
  return "";
}

std::string config_file(const std::string& name) {
  std::error_code error;
  if (name.empty() || fs::is_regular_file(name, error)) return name;
  if (fs::is_regular_file(name + ".yaml", error)) return name + ".yaml";
  if (const std::string found = shipped_config(name); !found.empty()) return found;
  if (fs::exists(name, error)) return name;  // a folder and the like: whoever reads it says so
  const std::string near = nearest(name, shipped_configs());
  throw InputError(name, "does not exist, and no configuration of that name comes with the program",
                   near.empty() ? "give a configuration file" : "did you mean '" + near + "'?");
}

}  // namespace restage
