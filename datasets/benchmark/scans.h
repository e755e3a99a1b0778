// Scan-like sequences: what a multi-view rig or one depth camera gives, in a frame of its own.
#pragma once

#include "datasets/benchmark/recipe.h"
#include "datasets/sampling/evaluation.h"
#include "datasets/schema.h"

namespace restage {

/// world = A p + b for points p of the scans, as rows of [A | b].
using SourceToWorld = Eigen::Matrix<double, 3, 4>;

/// A frame that a scanner might use: units of m, cm, mm, dm or inch, any of the 24 axis
/// permutations that keep the hand, any facing, an origin up to 2 m away.
SourceToWorld draw_frame(const RngKey& key);

inline constexpr size_t kLeastPoints = 64;  ///< of a frame that can be retargeted

/// Who is seen by which scanner.
struct ScanScene {
  Performance performance;
  const ScannerRecipe& scanner;
  const Body* intruder = nullptr;  ///< whose left forearm reaches towards A; null: nobody's
  RngKey key;
};

size_t points_in_first_frame(const ScanScene& scene);

/// Writes source.h5 (clouds, and A's joints, in the scanner's frame, which is the world if
/// `known_frame`) and what write_truth() writes. WorkError for a frame of fewer than kLeastPoints.
void write_scan_sequence(const ScanScene& scene, bool known_frame, bool rotations,
                         const FileInfo& info, const std::string& folder);

}  // namespace restage
