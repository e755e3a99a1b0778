// What an HDF5 file holds of every frame beside its points, taken along when `restage doctor --fix`
// writes the frames anew.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "datasets/doctor/finding.h"
#include "datasets/hdf5/file.h"

namespace restage {

/// Names of the data sets with a row for every frame ("/joints", "/a/b"), but for those that say
/// where frames and sequences begin.
std::vector<std::string> sets_of_frames(const h5::File& file, int64_t frames);

/// Writes these rows of all of them to `to`, which must not have them, in the precision that they
/// have: joints and vertices moved, radii scaled, rotations turned by `move`, all others as they
/// stand. Attributes of the file, its groups and sets go with them. Adds what is lost, and what was
/// not moved though nobody knows what it is, to the remarks.
void carry_frames(const h5::File& from, int64_t frames, std::span<const int64_t> rows,
                  const Similarity& move, h5::File& to, std::vector<std::string>& remarks);

}  // namespace restage
