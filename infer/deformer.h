// The surface of one target, frame after frame. Work that depends on the target alone is done once,
// in the constructor: points are sorted into tiles of neighbours, weights are laid out for the
// kernel. Work that depends on the pose alone is done once a frame.
#pragma once

#include "autograd/kernels/deform.h"
#include "nn/models/deformation.h"

namespace restage {

class Deformer {
 public:
  /// `points` [v, 3] at rest, `weights` [v, j], both float32. `offsets` is a network that maps c
  /// numbers of the pose and a point to the offset of that point; the network is copied; null: no
  /// offsets. Computes on `device`; arguments and results of all functions lie in the host's
  /// memory. ShapeError if the arguments do not fit together.
  Deformer(const Tensor& points, const Tensor& weights, const Mlp3* offsets, Device device = {});

  /// The posed points [v, 3]. `pose` [1, c]: the numbers that the offset network gets besides the
  /// point. `bones` [j, 3, 4]: for each joint, the map that takes a rest point to where that joint
  /// alone would carry the point. `dense`: every unit of the network is computed for every point,
  /// as a reference for tests.
  Tensor operator()(const Tensor& pose, const Tensor& bones, bool dense = false) const;
  /// The share of the units in the offset network's first layer that change sign inside a tile, on
  /// average over the tiles. Only for these units does the second layer have to be computed point
  /// by point. 0 without offsets.
  double active_share(const Tensor& pose) const;

 private:
  void take_offsets(const Mlp3& net);
  Tensor run(const Tensor& pose, const Tensor& bones, bool dense, Tensor* active) const;

  int64_t count_;
  Device device_;
  Tensor points_, weights_, order_;  // in tiles, in the layout of DeformArgs
  bool with_offsets_;
  OffsetField field_;  // without b1, which depends on the pose and is computed every frame
  Tensor pose_weights_, bias1_;  // [u, c] and [u], of the offset network's first layer
};

}  // namespace restage
