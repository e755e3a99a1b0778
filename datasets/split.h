// `restage data split`: who is in training, validation and test.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace restage {

inline constexpr std::array<const char*, 3> kSplits = {"train", "validation", "test"};

struct SplitOptions {
  std::array<double, 3> shares = {0.8, 0.1, 0.1};  ///< of kSplits, by seconds of motion
  uint64_t seed = 0;
  /// Clips are dealt instead of people: for recordings of too few of them. Each clip becomes a
  /// subject of its own ("ann/walk_01"), since no subject may be in two splits.
  bool by_clip = false;
  /// A data file whose bodies come along, or "builtin": recordings alone have nobody to be trained
  /// on. They keep the splits that they have there, but for a body whose id is a subject's. The
  /// file itself: its bodies are not dealt anew.
  std::string bodies = {};
  std::vector<std::string> only = {};  ///< these people, all others are left out; empty: everybody
};

struct SplitPart {
  std::vector<std::string> subjects, bodies;  ///< in the order of their names
  double seconds = 0;                         ///< of motion
};
using SplitSummary = std::array<SplitPart, 3>;

/// Writes `file`'s bodies and motions to `out` (whole or not at all) with splits dealt anew: whole
/// subjects by seconds of motion, and bodies by number; a body whose id is a subject's goes where
/// the subject goes. Everybody is in one split, and each whose share is above 0 has somebody who
/// moves; too few bodies for that are told in the log. InputError: shares that are no shares, fewer
/// subjects (clips) than splits, people in `only` whom the file does not know, two bodies of one
/// id, a file that is damaged or holds neither bodies nor motions, `out` is `file`.
SplitSummary split_data(const std::string& file, const std::string& out,
                        const SplitOptions& options);

}  // namespace restage
