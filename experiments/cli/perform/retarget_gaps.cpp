#include "experiments/cli/perform/retarget_gaps.h"

#include <algorithm>

#include "experiments/text.h"

namespace restage::cli {
namespace {

constexpr double kLongestGap = 1.0 / 3;  // seconds
constexpr size_t kListedGaps = 5;        // in a line of the log

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
    throw InputError("", fault.complaint() + ", and it is the first frame",
                     fault.mend() +
                         "; where others are good, begin with one, or --force, which "
                         "fills what is missing before it");
  if (open_ <= longest_) return;
  const Missing& first = all_[all_.size() - open_];
  throw InputError("",
                   first.fault.complaint() + ", and the " + std::to_string(longest_) +
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
      std::to_string(all_.size()) + " of the source's frames could not be used: " +
      listed(all_, kListedGaps, [](const Missing& m) {
        return std::to_string(m.frame) + " (" + m.fault.complaint() + ")";
      })};
  if (!filled.empty())
    out.push_back(
        std::to_string(filled.size()) +
        " of the result's frames are filled from those around: " + listed(filled, kListedGaps));
  return out;
}

Json Gaps::json() const {
  Json out = Json::array();
  for (const Missing& m : all_) out.push_back({{"frame", m.frame}, {"why", m.fault.complaint()}});
  return out;
}

}  // namespace restage::cli
