// Frames that an estimator left out because it saw nobody: WHAM's frame_ids say which.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "datasets/importers/motions/estimated_finder.h"

namespace restage::estimated_detail {
namespace {

constexpr int64_t kMostNumbered = int64_t{1} << 19;  // frames: almost five hours

/// Numbers of this many frames, each larger than the one before; nothing for other arrays.
std::vector<int64_t> rising(const SharedArray& array, int64_t frames) {
  const NpyHeader header = array->header();
  if (header.is_text() || header.shape != std::vector<int64_t>{frames}) return {};
  const NpyArray numbers = array->read();
  std::vector<int64_t> out;
  for (int64_t i = 0; i < frames; ++i) {
    const double x = numbers[i];
    if (!(std::abs(x) < 1e15) || x != std::floor(x)) return {};
    out.push_back(static_cast<int64_t>(x));
    if (i > 0 && out.back() <= out[out.size() - 2]) return {};
  }
  return out;
}

/// What all steps are multiples of, such as 4 where every fourth picture was looked at.
int64_t common_step(const std::vector<int64_t>& numbers) {
  int64_t out = 0;
  for (size_t k = 1; k < numbers.size(); ++k) out = std::gcd(out, numbers[k] - numbers[k - 1]);
  return out;
}

std::string remark_of(const std::string& name, const std::vector<int64_t>& numbers,
                      size_t missing) {
  int64_t longest = 0;
  for (size_t k = 1; k < numbers.size(); ++k)
    longest = std::max(longest, numbers[k] - numbers[k - 1] - 1);
  return cat(
      name, " leaves out ", counted(missing, "frame"), " between the first and the last",
      longest == static_cast<int64_t>(missing) ? "" : cat(" (at most ", longest, " in a row)"),
      ": interpolated");
}

}  // namespace

bool numbers_frames(const std::string& name) {
  return name == "frame_ids" || name == "frame_id" || name == "frame_idx" || name == "frames";
}

void fill_left_out(Arrays& arrays, ParameterHints& hints, const std::string& path) {
  const int64_t frames = frames_of(arrays);
  for (const auto& [name, ids] : arrays) {
    if (!numbers_frames(name) || frames < 2) continue;
    std::vector<int64_t> numbers = rising(ids, frames);
    if (numbers.empty()) {
      if (ids->header().shape == std::vector<int64_t>{frames})
        hints.remarks.push_back(name + " does not count up, and is not used");
      continue;
    }
    if (const int64_t step = common_step(numbers); step > 1) {
      hints.remarks.push_back(
          cat(name, " counts in steps of ", step, ": a step is taken for a frame"));
      for (size_t k = numbers.size(); k-- > 0;) numbers[k] = (numbers[k] - numbers[0]) / step;
    }
    const int64_t all = numbers.back() - numbers[0] + 1;
    if (all == frames) return;
    if (all > kMostNumbered)
      throw InputError(path, cat(name, " counts over ", all, " frames, for ", frames, " poses"),
                       "number the frames of one video, or leave " + name + " out");
    std::vector<int64_t> rows;
    for (size_t k = 0; k < numbers.size(); ++k) {
      while (std::ssize(rows) < numbers[k] - numbers[0]) {
        hints.missing.push_back(rows.size());
        rows.push_back(static_cast<int64_t>(k) - 1);
      }
      rows.push_back(static_cast<int64_t>(k));
    }
    hints.remarks.push_back(remark_of(name, numbers, hints.missing.size()));
    for (auto& [other, array] : arrays) {
      const std::vector<int64_t> shape = array->header().shape;
      if (shape.size() > 1 && shape[0] == frames) array = rows_of(array, rows);
    }
    return;
  }
}

}  // namespace restage::estimated_detail
