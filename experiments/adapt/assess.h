// How plausible the joints of a sequence of clouds are, without a truth: what `restage assess`
// prints. What each figure means, and how far it can be trusted: docs/real_scans.md.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/source.h"
#include "nn/models/extraction.h"
#include "nn/weights/bundle.h"

namespace restage {

/// Figures of one sequence; lengths are metres. Empty where a sequence is too short.
struct Assessment {
  int64_t frames = 0;  ///< of which joints were found
  /// Frames without: damaged, empty, too few points, no person's size; and why the first is.
  int64_t left_out = 0;
  std::string why;
  std::optional<double> bone_length_sd;  ///< mean over the 21 bones
  std::array<double, kJoints> bone_sds{};
  /// The same after the first two seconds, of bones that are held as retargeting does
  /// (SteadyBones).
  std::optional<double> held_bone_length_sd;
  double swaps = 0;  ///< share of the frames in which legs or arms changed sides
  /// Mean over the joints, and the frames that stand amid seven that follow each other.
  std::optional<double> jitter;
  std::optional<double> surface;  ///< of clouds from the person's own body, posed
  std::optional<double> confidence;
  std::optional<double> floor;  ///< how far the lowest points of who stands are from one floor
  /// Where to look: frames of the source, from 0.
  std::vector<int64_t> swapped, shakiest;
};

struct AssessOptions {
  uint64_t seed = 0;
  int samples = 4;  ///< views of a cloud, as in RetargetOptions
  /// Called with each cloud in which joints were found, and its number in the source, from 0.
  std::function<void(int64_t, const Points&, const SeenJoints&)> show = {};
};

/// Reads the source to its end. `weights` must hold a model for `skeleton`; `weights_name` is their
/// file, for errors. InputError: no frame can be used.
Assessment assess(Source& source, const Bundle& weights, const std::string& weights_name,
                  const AssessOptions& options);

}  // namespace restage
