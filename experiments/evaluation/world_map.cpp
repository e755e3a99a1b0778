#include "experiments/evaluation/world_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "datasets/doctor/mended_file.h"
#include "datasets/schema.h"

namespace restage {

void WorldMap::carry(std::span<double> points, bool rigid, double stretched) const {
  for (size_t i = 0; i + 2 < points.size(); i += 3) {
    Eigen::Map<Vec3> p(&points[i]);
    p = ((rigid ? 1 : scale) * (rotation * p) + stretched * shift).eval();
  }
}

void WorldMap::turn(std::span<double> quaternions) const {
  const Quat by = Quat(rotation).normalized();
  for (size_t i = 0; i + 3 < quaternions.size(); i += 4) {
    double* q = &quaternions[i];
    const Quat turned = by * Quat(q[0], q[1], q[2], q[3]);
    std::copy_n(std::array{turned.w(), turned.x(), turned.y(), turned.z()}.begin(), 4, q);
  }
}

double WorldMap::tilt() const {
  return std::acos(std::clamp(rotation(1, 1), -1.0, 1.0)) * 180 / std::numbers::pi;
}

std::optional<WorldMap> source_to_world(const std::string& truth) {
  const h5::File file = open_schema_file(truth);
  if (!file.has("/source_to_world")) return std::nullopt;
  const std::vector<double> rows = file.read<double>("/source_to_world", {3, 4});
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(rows.data());
  const double volume = m.leftCols<3>().determinant();
  if (!m.allFinite() || !(volume > 0))
    throw InputError(truth + ":/source_to_world", "is no rotation and scale",
                     "store world = A p + b as rows of [A | b]");
  WorldMap out;
  out.scale = std::cbrt(volume);
  out.rotation = m.leftCols<3>() / out.scale;
  out.shift = m.col(3);
  return out;
}

WorldMap mended_to_world(const std::string& mended, const WorldMap& to_world) {
  const std::optional<Similarity> repair = similarity_from(inspect(mended).transform);
  if (!repair)
    throw InputError(mended, "does not say how it was mended",
                     "give the file that restage doctor --fix wrote");
  WorldMap out;  // p' = scale rotation (p - offset), and world = A p + b
  out.scale = to_world.scale / repair->scale;
  out.rotation = to_world.rotation * repair->rotation.transpose();
  out.shift = to_world.scale * (to_world.rotation * repair->offset) + to_world.shift;
  return out;
}

}  // namespace restage
