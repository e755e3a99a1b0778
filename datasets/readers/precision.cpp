#include "datasets/readers/precision.h"

#include <cmath>
#include <cstdio>

#include "autograd/base/error.h"

namespace restage {
namespace {

constexpr double kBlur = 1e-3;

struct Bounds {
  double farthest = 0, extent = 0;
};

Bounds bounds_of(const Points& points) {
  if (points.empty()) return {};
  Point low = points[0], high = points[0];
  for (const Point& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {static_cast<double>(low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff()),
          (high.cast<double>() - low.cast<double>()).maxCoeff()};
}

double step_at(double x) { return x > 0 ? std::ldexp(1.0, std::ilogb(x) - 23) : 0; }

}  // namespace

double rounding_step(const Points& points) { return step_at(bounds_of(points).farthest); }

bool is_blurred(const Points& points) {
  const Bounds bounds = bounds_of(points);
  return bounds.extent > 0 && step_at(bounds.farthest) > kBlur * bounds.extent;
}

void check_precision(const Points& points, const std::string& where, const std::string& fix) {
  if (!is_blurred(points)) return;
  const Bounds bounds = bounds_of(points);
  char text[160];
  std::snprintf(text, sizeof text,
                "lies %.3g units from the origin, where single precision has steps of %.2g, and is "
                "only %.3g large",
                bounds.farthest, step_at(bounds.farthest), bounds.extent);
  throw InputError(where, text, fix);
}

}  // namespace restage
