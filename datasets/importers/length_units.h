// Units of length that skeletons come in, told by the length of a leg.
#pragma once

#include <string>

namespace restage {

struct LegUnit {
  const char* name;
  double from, to;  ///< a person's leg (hip-knee-ankle) in units: 0.4 to 1.4 m
  double metres;
};

/// Metres, decimetres, inches / 0.45 (the CMU set), inches, centimetres or millimetres; null if the
/// leg is no person's in any.
const LegUnit* unit_of_leg(double leg);
/// "centimetres" for 0.01; others as "0.123 m".
std::string unit_name(double metres);

}  // namespace restage
