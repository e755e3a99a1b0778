#include "datasets/sampling/frames.h"

#include <algorithm>
#include <map>

#include "datasets/readers/errors.h"

namespace restage {

void check_setting(const char* kind, bool good, const char* key, const char* range) {
  if (!good)
    throw InputError("", cat(kind, " setting '", key, "' is out of range"), cat("use ", range));
}

OwnBodies::OwnBodies(const Corpus& corpus) {
  std::map<std::string, int64_t> known;
  for (size_t b = 0; b < corpus.bodies.size(); ++b)
    known.emplace(corpus.bodies[b].id, static_cast<int64_t>(b));
  for (const Motion& motion : corpus.motions) {
    const auto found = known.find(motion.subject);
    body_.push_back(found == known.end() ? -1 : found->second);
  }
}

std::optional<size_t> OwnBodies::of(size_t motion) const {
  const int64_t body = body_.at(motion);
  return body < 0 ? std::nullopt : std::optional(static_cast<size_t>(body));
}

size_t OwnBodies::or_own(size_t drawn, size_t motion, Rng& rng) const {
  const auto own = of(motion);
  return own && rng.uniform() < 0.5 ? *own : drawn;
}

FrameIndex::FrameIndex(const std::vector<Motion>& motions, size_t window, size_t step)
    : step_(std::max<size_t>(1, step)) {
  uint64_t sum = 0;
  size_t longest = 0;
  for (size_t m = 0; m < motions.size(); ++m) {
    longest = std::max(longest, motions[m].frames());
    if (window == 0 || motions[m].frames() < window) continue;
    sum += (motions[m].frames() - window) / step_ + 1;
    motion_.push_back(m);
    ends_.push_back(sum);
  }
  if (ends_.empty())
    throw InputError("",
                     cat("no motion has ", window, " frames (", motions.size(),
                         " motions, the longest has ", longest, ")"),
                     "use shorter windows or longer motions");
}

FrameRef FrameIndex::at(uint64_t i) const {
  const auto end = std::upper_bound(ends_.begin(), ends_.end(), i);
  if (end == ends_.end()) throw ShapeError(cat("FrameIndex: place ", i, " of ", count()));
  const auto k = static_cast<size_t>(end - ends_.begin());
  return {motion_[k], step_ * static_cast<size_t>(i - (k > 0 ? ends_[k - 1] : 0))};
}

}  // namespace restage
