// Which data sets of an HDF5 file of others are clouds; used by hdf5_frames.h, which says how they
// are chosen.
#pragma once

#include <string>
#include <vector>

#include "datasets/hdf5/file.h"

namespace restage {

/// A sequence is one data set, or one a frame.
struct Hdf5Sequence {
  std::vector<std::string> sets;
  std::vector<std::string> remarks;
  int64_t window = 0;  ///< which of the sequences of a data set (CloudAxes::sequences)
};

/// All sequences of a file. `vertices`: how many there are, if the file says it; else 0.
/// InputError: there is none, several clouds that are no series.
std::vector<Hdf5Sequence> find_clouds(const h5::File& file, int64_t vertices);
/// Whether anything has the shape of a cloud.
bool has_clouds(const h5::File& file);

/// InputError for a data set whose rows may be x y z of one point after the other.
void refuse_flat_set(const h5::Dataset& set);

}  // namespace restage
