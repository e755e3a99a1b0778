// Batch, instance and layer normalisation (spec 7).
#pragma once

#include "autograd/kernels/norm.h"
#include "autograd/tape/tape.h"

namespace restage {

/// Where batch norm reports its statistics for the running averages: mean and biased variance [c],
/// f64.
struct BatchStatistics {
  Tensor mean, variance;
  int64_t count = 0;
};

/// x [..., c] normalised per channel over all rows with the batch's own statistics (training mode).
struct BatchNorm {
  static constexpr const char* name = "batch_norm";
  static constexpr const char* letters = "x[..., c], scale[c], shift[c]";
  double eps = 1e-5;
  BatchStatistics* statistics = nullptr;  ///< filled by forward if not null
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// x [n, v, c] normalised per sample and channel over v; no scale and shift.
struct InstanceNorm {
  static constexpr const char* name = "instance_norm";
  static constexpr const char* letters = "x[n, v, c]";
  double eps = 1e-5;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// x [..., c] normalised per row over c.
struct LayerNorm {
  static constexpr const char* name = "layer_norm";
  static constexpr const char* letters = "x[..., c], scale[c], shift[c]";
  double eps = 1e-5;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var batch_norm(const Var& x, const Var& scale, const Var& shift, double eps = 1e-5,
                      BatchStatistics* statistics = nullptr) {
  return call(BatchNorm{eps, statistics}, {x, scale, shift});
}
inline Var instance_norm(const Var& x, double eps = 1e-5) { return call(InstanceNorm{eps}, {x}); }
inline Var layer_norm(const Var& x, const Var& scale, const Var& shift, double eps = 1e-5) {
  return call(LayerNorm{eps}, {x, scale, shift});
}

}  // namespace restage
