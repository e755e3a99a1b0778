// Ops that only move numbers.
#pragma once

#include "autograd/kernels/layout.h"
#include "autograd/tape/tape.h"

namespace restage {

/// The same numbers under another shape (one dimension may be -1); shares memory.
struct Reshape {
  static constexpr const char* name = "reshape";
  static constexpr const char* letters = "x[...]";
  Shape shape;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

using Axes = InlineVector<int, Shape::kMaxRank>;

/// Axis i of the result is axis order[i] of x.
struct Permute {
  static constexpr const char* name = "permute";
  static constexpr const char* letters = "x[...]";
  Axes order;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Elements [from, to) along an axis.
struct Slice {
  static constexpr const char* name = "slice";
  static constexpr const char* letters = "x[... n ...], 0 <= from <= to <= n";
  int axis;
  int64_t from, to;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
  void add_to(Tensor& total, const Tensor& gy) const;
};

/// The parts of x of these sizes (up to 16) along an axis. Its gradient is one concatenation, where
/// slices of all parts would add up as many tensors of the size of x.
struct Split {
  static constexpr const char* name = "split";
  static constexpr const char* letters = "x[... n ...], sizes that add up to n";
  int axis;
  InlineVector<int64_t, kMaxInputs> sizes;
  void check(Inputs x) const;
  Tensors forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, std::span<const Tensor> gy, Needs needs) const;
};

/// Joins up to 16 tensors along an axis.
struct Concat {
  static constexpr const char* name = "concat";
  static constexpr const char* letters = "x_i[... n_i ...]";
  int axis;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Rows of x [n, v, c] by index (i32) [n, ...] -> [n, ..., c]; backward adds rows up in index
/// order.
struct Gather {
  static constexpr const char* name = "gather";
  static constexpr const char* letters = "x[n, v, c], index[n, ...]";
  Tensor index;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Rows of x [n, m, c] added into v rows by index (i32) [n, m] -> [n, v, c]; the transpose of
/// gather.
struct ScatterAdd {
  static constexpr const char* name = "scatter_add";
  static constexpr const char* letters = "x[n, m, c], index[n, m]";
  Tensor index;
  int64_t rows;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Windows of a sequence: x [n, l, c] -> [n, steps, c * k] (see kernels/layout.h).
struct Unfold {
  static constexpr const char* name = "unfold";
  static constexpr const char* letters = "x[n, l, c]";
  int64_t k, stride, pad_left, steps;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var reshape(const Var& x, const Shape& shape) { return call(Reshape{shape}, {x}); }
inline Var permute(const Var& x, const Axes& order) { return call(Permute{order}, {x}); }
inline Var slice(const Var& x, int axis, int64_t from, int64_t to) {
  return call(Slice{axis, from, to}, {x});
}
inline Vars split(const Var& x, int axis, std::initializer_list<int64_t> sizes) {
  return call(Split{axis, sizes}, {x});
}
inline Var concat(std::initializer_list<Var> xs, int axis) { return call(Concat{axis}, xs); }
/// The same of any number of tensors, but one.
Var concat(std::span<const Var> xs, int axis);
/// [n, v, c] -> [n times, v, c]: every item `times` times in a row.
Var repeat_items(const Var& x, int64_t times);
inline Var gather(const Var& x, const Tensor& index) { return call(Gather{index}, {x}); }
inline Var scatter_add(const Var& x, const Tensor& index, int64_t rows) {
  return call(ScatterAdd{index, rows}, {x});
}
/// 1-D convolution (PyTorch's cross-correlation) of x [n, l, c] with weight [out, c, k], bias [out]
/// -> [n, steps, out]; positions outside the sequence are 0.
Var conv1d(const Var& x, const Var& weight, const Var& bias, int64_t stride, int64_t pad_left,
           int64_t steps);

}  // namespace restage
