// Numbers and shares in the doctor's sentences; internal to this folder.
#pragma once

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"

namespace restage::doctor_detail {

/// Three digits: 0.0123, 1.7, 173.
inline std::string number(double x) { return format("%.3g", x); }

inline std::string per_cent(double share) {
  return format("%.*f %%", share < 0.1 && share > 0 ? 1 : 0, 100 * share);
}

}  // namespace restage::doctor_detail
