#include "experiments/cli/perform/track_work.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

}  // namespace

TrackWork::TrackWork(const std::string& out, const Json& command) {
  folder_ = out;
  while (folder_.size() > 1 && folder_.back() == '/') folder_.pop_back();
  folder_ += ".track";
  const std::string wanted = command.dump();
  std::error_code error;
  if (fs::exists(folder_, error)) {
    const bool ours = is_there(file("command.json"));
    if (!ours && !fs::is_empty(folder_, error))
      throw InputError(folder_, "is where the work is kept, and holds something else",
                       "move it, or name another --out");
    resumed_ = ours && read_file(file("command.json")) == wanted;
    if (!resumed_) remove();
  }
  if (resumed_) return;
  make_folder(folder_);
  write_file_atomically(file("command.json"), wanted);
}

void TrackWork::remove() const {
  std::error_code error;
  fs::remove_all(folder_, error);
}

std::string stamp_of(const std::string& path) {
  std::vector<std::string> lines;
  std::error_code error;
  const auto add = [&](const fs::path& file) {
    const auto time = fs::last_write_time(file, error).time_since_epoch().count();
    lines.push_back(file.string() + " " + std::to_string(fs::file_size(file, error)) + " " +
                    std::to_string(time));
  };
  if (fs::is_directory(path, error)) {
    for (const auto& entry : fs::recursive_directory_iterator(path, error))
      if (entry.is_regular_file(error)) add(entry.path());
  } else {
    add(path);
  }
  std::sort(lines.begin(), lines.end());
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return checksum(all);
}

}  // namespace restage::cli
