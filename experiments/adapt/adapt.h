// Adapting an extractor to somebody's sensor without a truth: what `restage adapt` does
// (docs/real_scans.md).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "experiments/adapt/assess.h"

namespace restage {

struct AdaptOptions {
  uint64_t seed = 0;
  int samples = 16;             ///< views of each cloud that the teacher averages
  int64_t steps = 300;          ///< of the optimiser
  int64_t batch = 16;           ///< clouds in a step
  double rate = 2e-4;           ///< of Adam, at the beginning
  double min_confidence = 0.9;  ///< of a frame that teaches
  double held_out = 0.25;       ///< the last part of each sequence, which only judges
};

/// Means over the held-out parts of the sequences; lengths are metres.
struct AdaptFigures {
  double bone_length_sd = 0, jitter = 0, surface = 0, swaps = 0;
  std::optional<double> confidence;  ///< if the network states how sure it is
};

struct Adapted {
  int64_t taught = 0, held_out = 0;  ///< frames of which something was learned; that judged
  /// Frames of the first parts of which nothing was: not one person's, or not surely; and why the
  /// first is.
  int64_t left_out = 0;
  std::string why;
  AdaptFigures before, after;
  /// How much smaller the first three figures are, as the geometric mean of their ratios: 0.1 is a
  /// tenth.
  double gain = 0;
  /// Whether the figures allow to use the result: at least 2 % gained, none of the three worse by
  /// more than 5 %, and no more sides changed.
  bool gained = false;
};

/// Trains the network of the role `skeleton` in `weights` on what it sees itself in the sequences
/// with many views, smoothed over time, with bones of constant length; and judges it on their last
/// parts. `weights` is changed also where nothing was gained. InputError: too few frames in which a
/// person is found.
Adapted adapt(std::vector<std::unique_ptr<Source>>& sequences, Bundle& weights,
              const std::string& weights_name, const AdaptOptions& options);

}  // namespace restage
