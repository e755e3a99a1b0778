// Frames of a set of motions, numbered through.
#pragma once

#include <optional>
#include <vector>

#include "autograd/base/rng.h"
#include "datasets/corpus.h"

namespace restage {

/// InputError that names the setting `key` of a kind of samples, and its range, unless it is
/// `good`.
void check_setting(const char* kind, bool good, const char* key, const char* range);

struct FrameRef {
  size_t motion = 0, frame = 0;
};

/// Whose body performs a motion. Where the data hold the body of who was recorded (its id is the
/// motion's subject), it takes every second sample of that motion, and evaluation's source is it.
class OwnBodies {
 public:
  explicit OwnBodies(const Corpus& corpus);
  /// Nothing if the corpus does not have it.
  std::optional<size_t> of(size_t motion) const;
  /// `drawn`, or the motion's own. Draws only where there is one.
  size_t or_own(size_t drawn, size_t motion, Rng& rng) const;

 private:
  std::vector<int64_t> body_;  // of each motion; -1: none
};

/// All places where `window` consecutive frames of one motion begin; with a `step`, only every
/// step-th from each motion's first (30: one frame per second of motion, as the paper samples).
class FrameIndex {
 public:
  /// InputError if there is none.
  explicit FrameIndex(const std::vector<Motion>& motions, size_t window = 1, size_t step = 1);
  uint64_t count() const { return ends_.back(); }
  /// Place number `i` < count().
  FrameRef at(uint64_t i) const;

  /// Motions that are long enough, and how many places one has.
  size_t motions() const { return motion_.size(); }
  FrameRef first(size_t k) const { return {motion_.at(k), 0}; }
  uint64_t places(size_t k) const { return ends_.at(k) - (k > 0 ? ends_[k - 1] : 0); }

 private:
  std::vector<size_t> motion_;  // the motions that are long enough
  std::vector<uint64_t> ends_;
  size_t step_;
};

}  // namespace restage
