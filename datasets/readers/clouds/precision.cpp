#include "datasets/readers/clouds/precision.h"

#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr double kBlur = 1e-3;

struct Bounds {
  double farthest = 0, extent = 0;
};

Bounds bounds_of(const Points& points) {
  if (points.empty()) return {};
  const Box box = box_of(points);
  return {double{box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff()},
          (box.max().cast<double>() - box.min().cast<double>()).maxCoeff()};
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
  throw InputError(where,
                   format("lies %.3g units from the origin, where single precision has steps of "
                          "%.2g, and is only %.3g large",
                          bounds.farthest, step_at(bounds.farthest), bounds.extent),
                   fix);
}

}  // namespace restage
