// CMU's recordings as others publish them (BVH, ASF/AMC), cut and packed into the one file that
// read_cmu() reads.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace restage {

/// Where originals are published: at one commit, as GitHub serves it.
struct CmuRepository {
  std::string tree;   ///< address of the list of its files (JSON of GitHub's "trees")
  std::string files;  ///< address that their paths are put behind
};

/// One clip: a clean run of frames of a recording.
struct CmuOriginal {
  std::string sha256;    ///< of what it packs to (sum_of_clip in cmu_pack.cpp)
  std::string clip;      ///< its name, 05_07a
  std::string file;      ///< the recording: the end of its path in whatever repository has it
  std::string skeleton;  ///< the same of its ASF file; empty for BVH
  int step = 0;          ///< frames of the recording to one at 30 fps: 4 of 120 fps, 2 of 60
  size_t first = 0, frames = 0;  ///< of the recording, at its rate
  double floor_y = 0;            ///< metres
  std::string subject, split, action;
};

struct CmuOriginals {
  std::map<std::string, CmuRepository> repositories;  ///< by name
  std::vector<CmuOriginal> clips;
};

/// Reads a list: lines `@NAME TREE FILES` and `SHA256 CLIP FILE SKELETON STEP FIRST FRAMES FLOOR_Y
/// SUBJECT SPLIT ACTION`, SKELETON being a file or "-", clips by name. InputError file:line.
CmuOriginals read_cmu_originals(const std::string& list);

/// Whether the path is `file` or ends in it, a whole name at least; also packed (FILE.xz).
bool is_path_of(const std::string& path, const std::string& file);

/// Finds the originals anywhere below `folder`, by their names, and writes `out` (clips30.h5, whole
/// or not at all). Where several files have the name, the one that packs to the listed sum is
/// meant. InputError: a recording is missing, damaged, or none of that name gives the sum.
/// WorkError: disk full.
void pack_cmu(const CmuOriginals& originals, const std::string& folder, const std::string& out);

/// Whether the file holds every clip of the list, whoever packed it.
bool is_packed_cmu(const CmuOriginals& originals, const std::string& path);

}  // namespace restage
