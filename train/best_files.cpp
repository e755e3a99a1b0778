#include "train/best_files.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kEnding = ".safetensors";

struct BestFile {
  std::string path;
  int64_t step = 0;
  double value = 0;
};

/// Reads a name that BestFiles::add() made: STAGE-STEP-FIGURE-VALUE.safetensors.
std::optional<BestFile> read_name(const fs::path& path, const std::string& stage) {
  std::string name = path.filename().string();
  if (!name.starts_with(stage + "-") || !name.ends_with(kEnding)) return {};
  name = name.substr(stage.size() + 1, name.size() - stage.size() - 1 - kEnding.size());
  const size_t first = name.find('-');
  const size_t second = first == std::string::npos ? first : name.find('-', first + 1);
  if (second == std::string::npos) return {};
  BestFile out{path.string(), 0, 0};
  const auto step = std::from_chars(name.data(), name.data() + first, out.step);
  const char *from = name.data() + second + 1, *end = name.data() + name.size();
  const auto value = std::from_chars(from, end, out.value);
  if (step.ec != std::errc() || step.ptr != name.data() + first || value.ec != std::errc() ||
      value.ptr != end)
    return {};
  return out;
}

/// The files of a stage, best first.
std::vector<BestFile> files_of(const std::string& folder, const std::string& stage) {
  std::vector<BestFile> out;
  std::error_code none;
  for (const auto& item : fs::directory_iterator(folder, none))
    if (auto file = read_name(item.path(), stage)) out.push_back(std::move(*file));
  std::sort(out.begin(), out.end(), [](const BestFile& a, const BestFile& b) {
    return a.value != b.value ? a.value < b.value : a.step < b.step;
  });
  return out;
}

void remove_best(const std::string& path) {
  std::error_code ignored;  // a file that stays does no harm
  fs::remove(path, ignored);
}

}  // namespace

BestFiles::BestFiles(const std::string& run, std::string stage, int64_t most)
    : folder_((fs::path(run) / "best").string()), stage_(std::move(stage)), most_(most) {}

void BestFiles::add(int64_t step, const std::string& figure, double value,
                    const std::function<std::string()>& bytes) const {
  if (most_ == 0 || !std::isfinite(value)) return;
  const std::string shown = format("%.6g", value);
  const double rounded = std::strtod(shown.c_str(), nullptr);
  std::vector<BestFile> there = files_of(folder_, stage_);
  for (const BestFile& file : there)
    if (file.step == step) remove_best(file.path);
  std::erase_if(there, [step](const BestFile& file) { return file.step == step; });
  const auto worse = std::find_if(there.begin(), there.end(), [&](const BestFile& file) {
    return rounded < file.value || (rounded == file.value && step < file.step);
  });
  const int64_t place = worse - there.begin();
  if (place >= most_) return;
  std::error_code ignored;  // writing the file says what is wrong
  fs::create_directories(folder_, ignored);
  write_file_atomically(folder_ + "/" + stage_ + format("-%09lld-", static_cast<long long>(step)) +
                            figure + "-" + shown + std::string(kEnding),
                        bytes());
  for (int64_t i = most_ - 1; i < std::ssize(there); ++i)
    remove_best(there[static_cast<size_t>(i)].path);
}

void BestFiles::forget_after(int64_t step) const {
  if (most_ == 0) return;
  for (const BestFile& file : files_of(folder_, stage_))
    if (file.step > step) remove_best(file.path);
}

}  // namespace restage
