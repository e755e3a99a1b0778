// The surface of one target, frame after frame: what depends on the target alone is made ready once
// (points sorted into tiles of neighbours, weights laid out for the kernel), what depends on the
// pose alone once a frame.
#pragma once

#include "autograd/kernels/deform.h"
#include "nn/models/deformation.h"

namespace restage {

class Deformer {
 public:
  /// points [v, 3] at rest; weights [v, j]; `offsets` maps [c numbers, point] to an offset (null:
  /// none) and is copied. float32. ShapeError if they do not fit. Computes on `device`; what goes
  /// in and comes out is the host's.
  Deformer(const Tensor& points, const Tensor& weights, const Mlp3* offsets, Device device = {});

  /// The posed points [v, 3]. `pose` [1, c] is what the offset network gets besides the point;
  /// `bones` [j, 3, 4] takes a rest point to where each joint alone would carry it. `dense`
  /// computes every unit for every point, to compare with.
  Tensor operator()(const Tensor& pose, const Tensor& bones, bool dense = false) const;
  /// The share of the offset network's first units that change sign inside a tile, on average over
  /// the tiles: what is left of its second layer. 0 without offsets.
  double active_share(const Tensor& pose) const;

 private:
  void take_offsets(const Mlp3& net);
  Tensor run(const Tensor& pose, const Tensor& bones, bool dense, Tensor* active) const;

  int64_t count_;
  Device device_;
  Tensor points_, weights_, order_;  // in tiles, as DeformArgs has them
  bool with_offsets_;
  OffsetField field_;            // b1 is of no frame yet
  Tensor pose_weights_, bias1_;  // [u, c] and [u] of the first layer
};

}  // namespace restage
