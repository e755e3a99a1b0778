// Frames of a source that cannot be used: how many may be filled, and what is said of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "experiments/cli/output.h"

namespace restage::cli {

/// A gap is filled from the frames around it if it is no longer than a third of a second (and at
/// least one frame); a gap at the end repeats the last frame. A longer gap, and a first frame that
/// cannot be used, are refused, unless the user forces it: then gaps of any length are filled, and
/// a gap at the beginning shows the first frame that can be used.
class Gaps {
 public:
  /// `frames` of the source, at `fps`.
  Gaps(int64_t frames, double fps, bool force);

  /// Frame `frame` (from 0) of the source cannot be used, as `fault` says. InputError if it makes
  /// the gap too long.
  void add(int64_t frame, const InputError& fault);
  /// A frame that can be used.
  void end();
  /// After the last frame of the source. The first one's fault if no frame could be used.
  void check_any() const;

  /// `filled`: frames of the result. Lines for the log; none if nothing was wrong.
  std::vector<std::string> lines(const std::vector<int64_t>& filled) const;
  /// [{"frame": of the source, "why": text}].
  Json json() const;

 private:
  struct Missing {
    int64_t frame;
    InputError fault;
  };

  int64_t frames_;
  bool force_, any_used_ = false;
  size_t longest_;            // gap, in frames
  std::vector<Missing> all_;  // in order
  size_t open_ = 0;           // of them, in the gap that has not ended
};

}  // namespace restage::cli
