#include "datasets/importers/motions/axis.h"

#include <cctype>
#include <cmath>
#include <iterator>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

constexpr const char* kAxisNames[] = {"auto", "x", "-x", "y", "-y", "z", "-z"};

constexpr LegUnit kAxisUnits[] = {{"metres", 0.4, 1.4, 1.0},
                                  {"decimetres", 4, 10, 0.1},
                                  {"inches / 0.45", 10, 20, 0.0254 / 0.45},
                                  {"inches", 20, 43.3, 0.0254},
                                  {"centimetres", 43.3, 140, 0.01},
                                  {"millimetres", 400, 1400, 0.001}};

}  // namespace

Axis parse_axis(const std::string& text, const std::string& option) {
  std::string name = lower_case(text);
  if (name.size() == 2 && (name[1] == '-' || name[1] == '+')) std::swap(name[0], name[1]);
  if (name.starts_with('+')) name.erase(0, 1);
  for (size_t i = 0; i < std::size(kAxisNames); ++i)
    if (name == kAxisNames[i]) return static_cast<Axis>(i);
  throw InputError("", option + " '" + text.substr(0, 40) + "' is no axis",
                   "give x, -x, y, -y, z or -z");
}

std::string to_string(Axis axis) { return kAxisNames[static_cast<size_t>(axis)]; }

Vec3 vector_of(Axis axis) {
  const int i = static_cast<int>(axis) - 1;
  return (i % 2 ? -1.0 : 1.0) * Vec3::Unit(i / 2);
}

Axis axis_near(const Vec3& v) {
  int i = 0;
  v.cwiseAbs().maxCoeff(&i);
  return static_cast<Axis>(1 + 2 * i + (v[i] < 0 ? 1 : 0));
}

Mat3 upright(Axis up) {
  if (up == Axis::minus_y) return Vec3(1, -1, -1).asDiagonal();
  const Vec3 from = vector_of(up), to = Vec3::UnitY(), axis = from.cross(to);
  Mat3 out = from * to.transpose();  // exact, unlike sines and cosines of 90 degrees
  out = to * from.transpose() - out + axis * axis.transpose();
  return up == Axis::y ? Mat3(Mat3::Identity()) : out;
}

Mat3 turn_in_quarters(double& yaw) {
  const double nearest = std::round(yaw / (M_PI / 2)) * (M_PI / 2);
  if (std::abs(yaw - nearest) > M_PI / 18) return turn_about_y(yaw);
  yaw = nearest;
  const double c = std::round(std::cos(yaw)), s = std::round(std::sin(yaw));
  Mat3 out;
  out << c, 0, s, 0, 1, 0, -s, 0, c;
  return out;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

const LegUnit* unit_of_leg(double leg) {
  for (const LegUnit& unit : kAxisUnits)
    if (leg >= unit.from && leg < unit.to) return &unit;
  return nullptr;
}

std::string unit_name(double metres) {
  for (const LegUnit& unit : kAxisUnits)
    if (std::abs(unit.metres / metres - 1) < 1e-6) return unit.name;
  return format("%.4g m", metres);
}

}  // namespace restage
