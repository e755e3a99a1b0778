// Products of matrices in columns, as cuBLAS has them.
#pragma once

#include "autograd/cuda/device_code.h"
#include "autograd/kernels/matmul_precision.h"

namespace restage::cuda {

/// C = op(A) op(B) + beta C for a batch, all stored by columns: op(A) is m x k, op(B) k x n.
struct Gemm {
  bool transpose_a, transpose_b;
  int64_t m, n, k;
  const void* a;
  /// Distance of columns (leading dimension); distance of one matrix of the batch from the next.
  int64_t a_columns_apart, a_apart;
  const void* b;
  int64_t b_columns_apart, b_apart;
  double beta;
  void* c;
  int64_t c_columns_apart, c_apart;
  int64_t batch;
  DType type;                 ///< f32 or f64
  MatmulPrecision precision;  ///< to which f32 operands may be rounded
};
/// Multiplies by cuBLAS; tests define another one.
void multiply(const Gemm& g);

}  // namespace restage::cuda
