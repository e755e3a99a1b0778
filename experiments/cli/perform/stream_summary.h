// restage stream: what became of what came, when the stream has ended.
#pragma once

#include <optional>
#include <string>

#include "experiments/cli/output.h"
#include "infer/live/cloud.h"
#include "infer/live/latency.h"

namespace restage::cli {

struct StreamSummary {
  live::Mailbox::Counts counts;
  int64_t out = 0, late = 0, unusable = 0, unsent = 0, restarts = 0, repeated = 0;
  size_t points_left_out = 0;
  double seconds = 0;
  std::string what = "cloud";     ///< or "line"
  size_t learning = 0;            ///< moments of joints that came, too few to be learnt from
  std::optional<InputError> why;  ///< of the last one that was left out

  Json json(const live::LatencyMeter& latency) const;
  std::string text(const live::LatencyMeter& latency) const;
  /// Why no pose was shown at all, of the input `name`; nothing: one was.
  std::optional<InputError> nothing_shown(const std::string& name) const;
};

}  // namespace restage::cli
