// Two characters, recordings or scans that are shown side by side, in step.
#pragma once

#include <array>

#include "experiments/pictures/view.h"

namespace restage {

struct TwoTakes {
  std::array<Showing, 2> shown;  ///< at one rate, of the same number of frames; labels are names
  double close_up = 0;           ///< of both
  Remarks remarks;               ///< of both, and which one is shorter
};

/// Both by the clock of `first`: its `fps` (nothing: 30), `every`, and its frame or time where
/// `single` is set, else the middle of the longer one. Whoever ends first holds the last frame.
/// InputError: read_showing()'s; a frame that neither has.
TwoTakes read_two_takes(ShowRequest first, ShowRequest second);

}  // namespace restage
