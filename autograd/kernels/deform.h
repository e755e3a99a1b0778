// The online frame's deformation: an offset network and linear blend skinning over a surface whose
// points were put in tiles of neighbours beforehand. f32 only; no gradient.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

inline constexpr int64_t kDeformTile = 48;   ///< points of a tile: whole vectors of any width
inline constexpr int64_t kDeformGroup = 8;   ///< neighbouring tiles that share work
inline constexpr int64_t kDeformAlign = 32;  ///< the width p below is a multiple of it

/// offset(x) = w3 relu(w2 relu(w1 x + b1) + b2) + b3 with u hidden units; p is u rounded up to a
/// multiple of kDeformAlign; the numbers beyond u are zero.
struct OffsetField {
  Tensor w1;  ///< [u, 3]
  Tensor b1;  ///< [u], includes what the other inputs of this frame give
  /// [u, p], row i holds what unit i of the first layer gives to all units of the second.
  Tensor w2;
  Tensor b2;         ///< [p]
  Tensor w3;         ///< [3, p]
  Tensor b3;         ///< [3]
  Tensor low, high;  ///< [t, u], least and largest w1 x in each tile
};

/// out[order] = sum_j weights_j (bones_j [x'; 1]), x' = x + offset(x). Units of the first layer
/// whose sign no point of a tile changes are affine in x there and need no product (exactly: only
/// the order of sums differs from the plain network).
struct DeformArgs {
  const Tensor& points;       ///< [t, 3, kDeformTile]
  const Tensor& weights;      ///< [t, j, kDeformTile]
  const Tensor& order;        ///< i32 [t, kDeformTile]; a place may occur twice in one tile
  const Tensor& bones;        ///< [j, 3, 4]
  const OffsetField* offset;  ///< null: none
  Tensor& out;                ///< [v, 3]
  Tensor* active = nullptr;   ///< i32 [t], how many units changed sign
  bool dense = false;         ///< compute every unit for every point (for comparison)
};

}  // namespace restage
