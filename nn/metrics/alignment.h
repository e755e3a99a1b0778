// How points are moved onto others; internal to this folder.
#pragma once

#include <cmath>

#include "nn/metrics/metrics.h"

namespace restage::metrics {

inline Value finite(double x) { return std::isfinite(x) ? Value(x) : std::nullopt; }

inline bool comparable(const Track& a, const Track& b) {
  return a.present() && b.present() && a.frames > 0 && a.points > 0 && a.frames == b.frames &&
         a.points == b.points;
}

inline Eigen::Vector3d apply(const Similarity& map, const Eigen::Vector3d& x) {
  return map.linear * x + map.shift;
}

/// procrustes() of points that come in pieces: all of them once for their middles, then, in the
/// same order, all of them once more for the map.
class Procrustes {
 public:
  void add_to_middles(const double* source, const double* target, int64_t count);
  void end_middles();
  void add_to_map(const double* source, const double* target, int64_t count);
  Similarity map(bool scale) const;

 private:
  int64_t count_ = 0;
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross_ = Eigen::Matrix3d::Zero();
  double spread_ = 0;
};

/// The map of one frame, for every mode but `sequence`.
Similarity align_frame(const Track& pred, const Track& truth, int64_t frame, const Alignment& how);
/// Mean distance of the points of one frame.
double frame_distance(const Track& pred, const Track& truth, int64_t frame, const Similarity& map);

}  // namespace restage::metrics
