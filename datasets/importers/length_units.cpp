#include "datasets/importers/length_units.h"

#include "autograd/base/format.h"

#include <cmath>

namespace restage {
namespace {

constexpr LegUnit kUnits[] = {{"metres", 0.4, 1.4, 1.0},
                              {"decimetres", 4, 10, 0.1},
                              {"inches / 0.45", 10, 20, 0.0254 / 0.45},
                              {"inches", 20, 50, 0.0254},
                              {"centimetres", 50, 140, 0.01},
                              {"millimetres", 400, 1400, 0.001}};

}  // namespace

const LegUnit* unit_of_leg(double leg) {
  for (const LegUnit& unit : kUnits)
    if (leg >= unit.from && leg < unit.to) return &unit;
  return nullptr;
}

std::string unit_name(double metres) {
  for (const LegUnit& unit : kUnits)
    if (std::abs(unit.metres / metres - 1) < 1e-6) return unit.name;
  return format("%.4g m", metres);
}

}  // namespace restage
