// Floating-point operations of one forward pass by the plain algorithm, counted from the sizes of
// the models; multiply-add = 2. A backward pass is twice as much.
#pragma once

#include "nn/models/deformation.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/smrm.h"

namespace restage::bench {

inline double gflop_of(double multiply_adds) { return 2e-9 * multiply_adds; }

/// One block of vector attention over `points` points with `c` channels.
inline double attention_gflop(int64_t points, int64_t c, const PointTransformerConfig& m = {}) {
  const double pairs = static_cast<double>(points * std::min(points, m.neighbours)),
               d = static_cast<double>(m.width);
  return gflop_of(pairs * (3 * d * d + 3 * d) +
                  static_cast<double>(points) * (2 * static_cast<double>(c) * d + 3 * d * d));
}

inline double extractor_gflop() {
  const PointTransformerConfig m;
  int64_t points = m.points, c = m.base;
  double total =
      gflop_of(static_cast<double>(points * (3 * c + c * c))) + attention_gflop(points, c);
  for (int64_t i = 0; i < m.blocks; ++i) {
    points /= 4;
    const int64_t rows = points * m.neighbours, in = c + 3;
    c *= 2;
    total += gflop_of(static_cast<double>(rows * (in * c + c * c))) + attention_gflop(points, c);
  }
  return total +
         gflop_of(static_cast<double>(c * m.head1 + m.head1 * m.head2 + m.head2 * 3 * kJoints));
}

inline double pointnet_gflop() {
  const PointNetConfig m;
  const auto& w = m.widths;
  const int64_t point = 3 * w[0] + w[0] * w[1] + w[1] * w[2], head = w[2] * w[3] + w[3] * w[4];
  return gflop_of(static_cast<double>(2 * (m.points * point + head) + w[4] * (9 + 3 * kJoints)));
}

/// A GRU stack, one frame.
inline double gru_gflop(int64_t in, int64_t hidden, int layers) {
  return gflop_of(static_cast<double>(3 * hidden * (in + hidden) +
                                      (layers - 1) * 3 * hidden * (hidden + hidden)));
}

/// SMRM, one frame.
inline double motion_gflop() {
  const SmrmConfig m;
  return gru_gflop(3 * (m.joints + 1), m.hidden, m.layers) +
         gru_gflop(m.hidden + 3 * m.joints, m.hidden, m.layers) +
         gflop_of(static_cast<double>(m.hidden * (6 * m.joints + 3)));
}

inline double mlp_gflop(int64_t points, int64_t in, int64_t out) {
  return gflop_of(
      static_cast<double>(points * (in * MlpConfig().width + MlpConfig().width * MlpConfig().width +
                                    MlpConfig().width * out)));
}
inline double weights_gflop(int64_t points) { return mlp_gflop(points, 3 * kJoints + 3, kJoints); }
inline double offsets_gflop(int64_t points) { return mlp_gflop(points, 3 * kJoints + 3, 3); }
/// Linear blend skinning.
inline double skinning_gflop(int64_t points) {
  return gflop_of(static_cast<double>(points * (kJoints * 12 + 12)));
}

}  // namespace restage::bench
