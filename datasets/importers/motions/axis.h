// The axes of foreign files (which one is up, which one somebody faces) and their units of length,
// told by the length of a leg.
#pragma once

#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// A direction along one of the file's axes.
enum class Axis { automatic, x, minus_x, y, minus_y, z, minus_z };

/// "auto", "x", "+x", "-x", "x-" ..., in any case; InputError naming `option` for anything else.
Axis parse_axis(const std::string& text, const std::string& option);
std::string to_string(Axis axis);

/// The unit vector along an axis that is not automatic.
Vec3 vector_of(Axis axis);
/// The axis that a direction is nearest to.
Axis axis_near(const Vec3& v);
/// The quarter or half turn that takes the file's `up` to y; for z it is (x, y, z) -> (x, z, -y).
Mat3 upright(Axis up);

/// The turn about y by `yaw`, radians; by whole quarters where it is within 10 degrees of one,
/// which `yaw` becomes.
Mat3 turn_in_quarters(double& yaw);
/// Radians; 0 if either has no length.
double angle_between(const Vec3& a, const Vec3& b);

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
