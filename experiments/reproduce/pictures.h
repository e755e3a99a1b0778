// The pictures that a paper.yaml asks for: sequences of the benchmark at a few moments, with a line
// for what goes in, one for what each row's system makes of it, and one for the truth.
#pragma once

#include <string>
#include <vector>

#include "experiments/reproduce/evidence.h"

namespace restage::reproduce {

struct Drawn {
  std::string file;  ///< its name in the folder
  std::string says;
};

/// Draws them as FOLDER/NAME-N.jpg, by the trials of each row's lowest seed. Where weights are
/// missing (results that were committed have none), or the sweep knows no benchmark, a line of the
/// log says so and an earlier picture stays. Returns those that are there.
std::vector<Drawn> draw_pictures(const Evidence& evidence, const tables::Results& results,
                                 const std::string& folder);

}  // namespace restage::reproduce
