// `restage data import`: foreign data into one file of the project's schema.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/bvh.h"
#include "datasets/schema.h"

namespace restage {

struct ImportOptions {
  BvhOptions bvh;       ///< for BVH files
  std::string garment;  ///< dress the bodies in this garment of body/clothes; empty: skin
  std::string license = "unknown";  ///< of BVH files; a data folder's is known
};

struct ImportSummary {
  size_t bodies = 0, motions = 0, frames = 0;
  std::vector<std::string> skipped;  ///< files of a BVH folder that could not be used, and why
};

/// Licence, origin and required acknowledgement of what comes out of a data folder.
FileInfo data_folder_info(bool bodies, bool clips);

/// Writes `out` (whole or not at all) from `source`, which is
/// - a folder laid out like the project's data folder: all bodies of body/makehuman.h5 by
///   body/bodies.csv and all clips of cmu/clips30.h5 (one of the two may be absent);
/// - a BVH file (.bvh, .bvh.xz): one motion;
/// - a folder of BVH files, in the order of their names; unusable ones are skipped with a warning.
/// InputError: no such source, nothing usable in it, damaged data. WorkError: disk full.
ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options = {});

}  // namespace restage
