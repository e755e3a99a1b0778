// Coordinates far from the origin, as of maps: points are single precision, 24 binary digits.
#pragma once

#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// Whether single precision rounds these points to steps of more than a thousandth of what they
/// extend over (2 mm of a person).
bool is_blurred(const Points& points);
/// The largest such step, in the points' units.
double rounding_step(const Points& points);
/// InputError if they are blurred; `fix` says what to do.
void check_precision(const Points& points, const std::string& where, const std::string& fix);
/// The advice for numbers of double precision and texts.
inline constexpr const char* kDoctorMoves =
    "restage doctor SOURCE --fix OUT moves it to the origin";
/// The advice where they are stored so: what single precision has rounded the doctor cannot mend.
inline constexpr const char* kSubtract =
    "subtract an offset from all coordinates before they are saved in single precision";

}  // namespace restage
