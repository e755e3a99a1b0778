// Fits the coefficients of datasets/doctor/orientation_prior.inc.
#pragma once

#include "bench/doctor/scans.h"

namespace restage::bench {

struct FitOptions {
  size_t kinds = 6;  ///< of attitude, kPlaces coefficients each
  int epochs = 6;
  double decay = 1e-6;  ///< pulls the coefficients towards 0
  uint64_t seed = 1;
};

/// Conditional logit over 6 up axes x 8 headings: a scan's true turn against the others under its
/// up axis and a random few of the rest. `clouds`: normalised, y up, facing +z. Adam; the same bits
/// for any number of threads. `say` gets a line an epoch.
std::vector<float> fit_orientation_prior(const std::vector<Points>& clouds,
                                         const FitOptions& options,
                                         void (*say)(const std::string&));

}  // namespace restage::bench
