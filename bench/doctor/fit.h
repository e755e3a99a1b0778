// Fits the network of datasets/doctor/orientation_model.h.
#pragma once

#include <functional>
#include <string>

#include "bench/doctor/scans.h"
#include "datasets/doctor/orientation_model.h"

namespace restage::bench {

using doctor_detail::OrientationNet;

struct FitOptions {
  int64_t steps = 25000;  ///< of 32 examples
  double rate = 2e-3;     ///< of Adam; falls to nothing along half a cosine
  double tilt = 4;        ///< degrees by which people lean in examples, standard deviation
  uint64_t seed = 1;
};

/// What the network learns from.
struct FitExample {
  Points points;       ///< normalised, y up, facing +z
  bool person = true;  ///< else no turn is likelier than another
};

/// Cross-entropy over 6 up axes x 8 headings: a scan's true turn against the others under its up
/// axis and a random few of the rest. `example` makes example number i; no two steps share one. The
/// same bits for any number of threads. `say` gets a few lines.
void fit_orientation_net(const std::function<FitExample(uint64_t)>& example,
                         const FitOptions& options, void (*say)(const std::string&),
                         OrientationNet& net);

}  // namespace restage::bench
