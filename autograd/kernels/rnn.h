// One step of a GRU (PyTorch's equations, spec 3.2), gates stacked r, z, n.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// gi [n, 3h] = W_i x + b_i, gh [n, 3h] = W_h h + b_h, h [n, h] -> out [n, h]; gates [n, 4h] keeps
/// r, z, n and the third part of gh for the backward pass.
struct GruCellArgs {
  static constexpr std::string_view name = "gru_cell";
  const Tensor& gi;
  const Tensor& gh;
  const Tensor& h;
  Tensor& out;
  Tensor& gates;
};
/// gy [n, h] -> g_gi [n, 3h], g_gh [n, 3h], and out [n, h] = the direct part of the gradient of h.
struct GruCellGradArgs {
  static constexpr std::string_view name = "gru_cell_grad";
  const Tensor& gates;
  const Tensor& h;
  const Tensor& gy;
  Tensor& g_gi;
  Tensor& g_gh;
  Tensor& out;
};

}  // namespace restage
