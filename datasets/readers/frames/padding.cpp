#include "datasets/readers/frames/padding.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "autograd/base/words.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr int64_t kFewestKept = 64;  // points of a single cloud that may be cut

std::vector<int64_t> without_ones(const std::vector<int64_t>& shape) {
  std::vector<int64_t> out;
  for (const int64_t n : shape)
    if (n != 1) out.push_back(n);
  return out;
}

bool has_shape(const BesideArray& array, const std::vector<int64_t>& shape) {
  return without_ones(array.shape) == without_ones(shape);
}

bool says(const std::string& name, std::initializer_list<const char*> words) {
  const std::string low = lower_case(name);
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return low.find(word) != std::string::npos; });
}

}  // namespace

FramePadding::FramePadding(int64_t sequences, int64_t steps, int64_t points,
                           const std::vector<BesideArray>& beside)
    : sequences_(sequences), steps_(steps), points_(points) {
  for (const BesideArray& array : beside)
    if (names_lengths(array.name) && take_counts(array)) return;
  for (const BesideArray& array : beside)
    if (says(array.name, {"mask", "valid", "pad"}) && take_mask(array)) return;
}

bool FramePadding::take_counts(const BesideArray& array) {
  const int64_t frames = sequences_ * steps_;
  const bool each = has_shape(array, {sequences_, steps_}) || has_shape(array, {frames});
  const bool steps = has_shape(array, {steps_}), lasting = has_shape(array, {sequences_});
  if (!each && !steps && !lasting) return false;
  const std::vector<double> numbers = array.read();
  for (const double n : numbers)
    if (!(n >= 0 && n < 1e15) || n != std::floor(n)) return false;
  if (numbers.empty()) return false;
  const double most = *std::max_element(numbers.begin(), numbers.end());
  // Of sequences of unequal length what says how long they are.
  const bool lengths = lasting && most <= static_cast<double>(steps_) && steps_ < points_;
  if (frames == 1 && numbers[0] < static_cast<double>(kFewestKept)) return false;
  if (!lengths && !each && !steps) return false;
  for (int64_t f = 0; f < frames; ++f) {
    const int64_t s = f / steps_, t = f % steps_;
    const double n = numbers[static_cast<size_t>(lengths ? s : each ? f : t)];
    const double of_frame = !lengths ? n : static_cast<double>(t) < n ? 1e15 : 0;
    counts_.push_back(static_cast<int64_t>(std::min(of_frame, static_cast<double>(points_))));
  }
  name_ = array.name;
  return true;
}

bool FramePadding::take_mask(const BesideArray& array) {
  if (!has_shape(array, {sequences_, steps_, points_}) &&
      !has_shape(array, {sequences_ * steps_, points_}))
    return false;
  for (const double value : array.read()) {
    if (value != 0 && value != 1) return mask_.clear(), false;
    mask_.push_back(value != 0);
  }
  if (std::all_of(mask_.begin(), mask_.end(), [&](uint8_t m) { return m == mask_[0]; }))
    return mask_.clear(), false;
  masks_padding_ = says(array.name, {"pad", "invalid"});
  name_ = array.name;
  return true;
}

void FramePadding::cut(int64_t frame, Points& points) {
  const size_t before = points.size();
  if (!counts_.empty())
    points.resize(std::min(before, static_cast<size_t>(counts_[static_cast<size_t>(frame)])));
  else if (!mask_.empty())
    cut_by_mask(frame, points);
  else
    cut_zeros(points);
  left_out_ += static_cast<int64_t>(before - points.size());
  frames_cut_ += points.size() < before;
}

void FramePadding::cut_by_mask(int64_t frame, Points& points) {
  const uint8_t* mask = &mask_[static_cast<size_t>(frame * points_)];
  if (!mask_is_sure_) {  // zeros are none, whatever the mask is called
    std::array<bool, 2> any{}, zeros{true, true};
    for (size_t i = 0; i < points.size(); ++i) {
      any[mask[i]] = true;
      zeros[mask[i]] = zeros[mask[i]] && points[i].isZero(0);
    }
    mask_is_sure_ = any[0] && any[1];
    if (mask_is_sure_ && zeros[0] != zeros[1]) masks_padding_ = zeros[1];
  }
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i)
    if ((mask[i] != 0) != masks_padding_) points[kept++] = points[i];
  points.resize(kept);
}

/// One zero alone may be a point. A frame of zeros alone shows nothing; where it is one of a
/// sequence among others it is none.
void FramePadding::cut_zeros(Points& points) {
  size_t kept = points.size();
  while (kept > 0 && points[kept - 1].isZero(0)) --kept;
  if (points.size() - kept < 2 || (kept == 0 && sequences_ == 1)) return;
  points.resize(kept);
}

std::string FramePadding::remark() const {
  if (left_out_ == 0) return "";
  const std::string cut = cat("left out ", counted(static_cast<size_t>(left_out_), "point"), " of ",
                              counted(static_cast<size_t>(frames_cut_), "frame"));
  return name_.empty() ? cat(cut, ": exactly zero, at the end, as frames are filled up")
                       : cat(cut, ": by ", text::quote(name_), " they only fill the frame up");
}

}  // namespace restage
