// `restage data import`: foreign data into one file of the project's schema.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/bvh.h"
#include "datasets/importers/report.h"

namespace restage {

struct ImportOptions {
  /// For BVH files; of glTF files subject, split, action, scale and up.
  BvhOptions bvh;
  std::string clip;     ///< of glTF files: this animation only; empty: all
  std::string garment;  ///< dress the bodies in this garment of body/clothes; empty: skin
  std::string license = "unknown";  ///< of foreign files; a data folder's is known
};

struct ImportSummary {
  size_t bodies = 0, motions = 0, frames = 0;
  std::vector<std::string> skipped;   ///< files of a folder that could not be used, and why
  std::vector<ImportReport> reports;  ///< per file: what was found in it
};

/// Writes `out` (whole or not at all) from `source`, which is
/// - a folder laid out like the project's data folder: all bodies of body/makehuman.h5 by
///   body/bodies.csv and all clips of cmu/clips30.h5 (one of the two may be absent);
/// - a BVH file (.bvh, .bvh.xz): one motion;
/// - a rigged character (.glb, .gltf, .vrm): its body and its animations (gltf_character.h);
/// - a folder of such files, in the order of their names; unusable ones are skipped with a warning.
/// InputError: no such source, nothing usable in it, damaged data. WorkError: disk full.
ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options = {});

}  // namespace restage
