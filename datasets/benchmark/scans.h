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

/// Writes source.h5 (clouds, and A's joints, in the scanner's frame) and what write_truth() writes.
/// `intruder` (may be null): whose left forearm reaches towards A.
void write_scan_sequence(const Performance& performance, const ScannerRecipe& scanner,
                         const ScanRecipe& recipe, const Body* intruder, const FileInfo& info,
                         const RngKey& key, const std::string& folder);

}  // namespace restage
