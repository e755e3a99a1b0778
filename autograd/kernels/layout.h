// Moving numbers: slices, concatenation, permutation, gathering. f32 and f64.
#pragma once

#include <array>

#include "autograd/kernels/kernel.h"

namespace restage {

/// For every o: out[o*out_stride + out_offset + i] = x[o*x_stride + x_offset + i], i < count.
/// Slices and concatenation along one axis are both of this kind. `add`: += (f32 and f64).
struct CopyBlocksArgs {
  const Tensor& x;
  Tensor& out;
  int64_t outer, count, x_stride, x_offset, out_stride, out_offset;
  bool add = false;
};
/// out axis i = x axis order[i].
struct PermuteArgs {
  const Tensor& x;
  Tensor& out;
  std::array<int, Shape::kMaxRank> order;
};
/// Whether an i32 index, which the host can read, is within [0, limit). Ops check an index before
/// they launch a kernel. If the host cannot read the index, the kernel checks it, and the error
/// comes with Backend::synchronise().
bool index_within(const Tensor& index, int64_t limit);

/// x [n, v, c], index i32 [n, m] -> out [n, m, c].
struct GatherArgs {
  const Tensor& x;
  const Tensor& index;
  Tensor& out;
};
/// out [n, v, c] = sum of gy rows [n, m, c] by index, in order of m.
struct ScatterAddArgs {
  const Tensor& gy;
  const Tensor& index;
  Tensor& out;
};
/// Windows of a sequence: x [n, l, c] -> out [n, steps, c * k], channel-major (PyTorch's conv
/// layout); positions outside [0, l) are 0; step s starts at s * stride - pad_left.
struct UnfoldArgs {
  const Tensor& x;
  Tensor& out;
  int64_t k, stride, pad_left;
};
/// The transpose of unfold: out [n, l, c] = sums of gy [n, steps, c * k].
struct FoldArgs {
  const Tensor& gy;
  Tensor& out;
  int64_t k, stride, pad_left;
};

}  // namespace restage
