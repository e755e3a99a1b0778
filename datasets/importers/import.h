// `restage data import`: foreign data into one file of the project's schema.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/motion_clip.h"
#include "datasets/importers/report.h"

namespace restage {

struct ImportOptions {
  MotionOptions motion;  ///< for BVH and AMC files
  std::string asf;       ///< skeleton of AMC files; empty: the one beside each
  std::string garment;   ///< dress the bodies in this garment of body/clothes; empty: skin
  std::string license = "unknown";  ///< of BVH and AMC files; a data folder's is known
};

struct ImportSummary {
  size_t bodies = 0, motions = 0, frames = 0;
  std::vector<std::string> skipped;   ///< files of a folder that could not be used, and why
  std::vector<ImportReport> reports;  ///< of each recording, in the order of their names
};

/// Writes `out` (whole or not at all) from `source`, which is
/// - a folder laid out like the project's data folder: all bodies of body/makehuman.h5 by
///   body/bodies.csv and all clips of cmu/clips30.h5 (one of the two may be absent);
/// - a recording (.bvh, or .amc with its .asf; any may end in .xz): one motion;
/// - a folder of them, in the order of their names; unusable ones are skipped with a warning.
/// InputError: no such source, nothing usable in it, damaged data. WorkError: disk full.
ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options = {});

}  // namespace restage
