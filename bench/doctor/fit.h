// Fits the coefficients of datasets/doctor/orientation_prior.inc.
#pragma once

#include "bench/doctor/scans.h"

namespace restage::bench {

struct FitOptions {
  size_t scans = 16000;
  int epochs = 8;
  uint64_t seed = 1;
};

/// Conditional logit over 6 up axes x 8 headings: a scan's true turn against the 47 others. Adam;
/// the same bits for any number of threads. `say` gets a line an epoch.
std::vector<float> fit_orientation_prior(const ScanMaker& scans, const FitOptions& options,
                                         void (*say)(const std::string&));

}  // namespace restage::bench
