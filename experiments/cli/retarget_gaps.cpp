#include "experiments/cli/retarget_gaps.h"

#include <algorithm>

#include "experiments/text.h"

namespace restage::cli {
namespace {

constexpr double kLongestGap = 1.0 / 3;  // seconds
constexpr size_t kListedGaps = 5;        // in a line of the log

/// "1, 2, 3, 4, 5 and 7 more".
template <class Items, class Text>
std::string listed(const Items& items, const Text& text) {
  std::string out;
  for (size_t i = 0; i < items.size() && i < kListedGaps; ++i)
    out += (i > 0 ? ", " : "") + text(items[i]);
  if (items.size() > kListedGaps)
    out += " and " + std::to_string(items.size() - kListedGaps) + " more";
  return out;
}

}  // namespace

Gaps::Gaps(int64_t frames, double fps, bool force)
    : frames_(frames),
      force_(force),
      longest_(std::max<size_t>(1, static_cast<size_t>(fps * kLongestGap + 1e-9))) {}

void Gaps::add(int64_t frame, const InputError& fault) {
  all_.push_back({frame, fault});
  ++open_;
  if (force_) return;
  if (frames_ == 1) throw fault;
  if (!any_used_)
    throw InputError("", cause_of(fault) + ", and it is the first frame",
                     mend_of(fault) +
                         "where others are good, begin with one, or --force, which "
                         "fills what is missing before it");
  if (open_ <= longest_) return;
  const Missing& first = all_[all_.size() - open_];
  throw InputError("",
                   cause_of(first.fault) + ", and the " + std::to_string(longest_) +
                       " frames after it cannot be used either: a gap of over a third of a second",
                   "see what 'restage doctor' says of it, cut the source there, or --force, which "
                   "fills what is empty or damaged and takes the rest");
}

void Gaps::end() {
  any_used_ = true;
  open_ = 0;
}

void Gaps::check_any() const {
  if (!any_used_ && !all_.empty()) throw all_.front().fault;
}

std::vector<std::string> Gaps::lines(const std::vector<int64_t>& filled) const {
  if (all_.empty()) return {};
  std::vector<std::string> out = {
      std::to_string(all_.size()) +
      " of the source's frames could not be used: " + listed(all_, [](const Missing& m) {
        return std::to_string(m.frame) + " (" + cause_of(m.fault) + ")";
      })};
  if (!filled.empty())
    out.push_back(std::to_string(filled.size()) +
                  " of the result's frames are filled from those around: " +
                  listed(filled, [](int64_t frame) { return std::to_string(frame); }));
  return out;
}

Json Gaps::json() const {
  Json out = Json::array();
  for (const Missing& m : all_) out.push_back({{"frame", m.frame}, {"why", cause_of(m.fault)}});
  return out;
}

}  // namespace restage::cli
