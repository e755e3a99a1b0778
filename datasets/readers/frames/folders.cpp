#include "datasets/readers/frames/folders.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "datasets/readers/frames/frame_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Calls visit(entry) for everything in a folder that is not hidden; one that cannot be read is
/// empty.
template <class Visit>
void each_entry(const std::string& folder, const Visit& visit) {
  std::error_code error;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error))
    if (item->path().filename().string()[0] != '.') visit(*item);
}

}  // namespace

std::vector<std::string> folders_below(const std::string& root) {
  std::vector<std::string> out{root};
  std::error_code error;
  std::set<fs::path> seen{fs::canonical(root, error)};
  for (size_t i = 0; i < out.size(); ++i)
    each_entry(std::string(out[i]), [&](const fs::directory_entry& entry) {
      std::error_code ignored;
      if (entry.is_directory(ignored) && seen.insert(fs::canonical(entry.path(), ignored)).second)
        out.push_back(entry.path().string());
    });
  std::sort(out.begin() + 1, out.end(), natural_less);
  return out;
}

std::vector<std::string> files_below(const std::string& root, bool (*wanted)(const std::string&)) {
  std::vector<std::string> out;
  for (const std::string& folder : folders_below(root))
    each_entry(folder, [&](const fs::directory_entry& entry) {
      std::error_code ignored;
      if (entry.is_regular_file(ignored) && wanted(entry.path().string()))
        out.push_back(entry.path().string());
    });
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

bool is_inside(const std::string& name) {
  const fs::path path(name);
  return path.is_relative() && path.has_filename() && path.filename() != "." &&
         path.lexically_normal() == path && *path.begin() != ".." &&
         name.find_first_of(std::string_view("\\\0", 2)) == std::string::npos;
}

}  // namespace restage
