#include "autograd/cuda/gemm.h"

namespace restage::cuda {

void multiply(const Gemm& g) {
  const double beta64 = g.beta, one64 = 1;
  const float beta32 = static_cast<float>(g.beta), one32 = 1;
  const bool wide = g.type == DType::f64;
  const cudaDataType_t type = wide ? CUDA_R_64F : CUDA_R_32F;
  const cublasComputeType_t compute = wide ? CUBLAS_COMPUTE_64F
                                      : g.precision == MatmulPrecision::tf32
                                          ? CUBLAS_COMPUTE_32F_FAST_TF32
                                          : CUBLAS_COMPUTE_32F;
  const auto op = [](bool transpose) { return transpose ? CUBLAS_OP_T : CUBLAS_OP_N; };
  check(cublasGemmStridedBatchedEx(cublas(), op(g.transpose_a), op(g.transpose_b),
                                   static_cast<int>(g.m), static_cast<int>(g.n),
                                   static_cast<int>(g.k),
                                   wide ? static_cast<const void*>(&one64) : &one32, g.a, type,
                                   static_cast<int>(g.a_columns_apart), g.a_apart, g.b, type,
                                   static_cast<int>(g.b_columns_apart), g.b_apart,
                                   wide ? static_cast<const void*>(&beta64) : &beta32, g.c, type,
                                   static_cast<int>(g.c_columns_apart), g.c_apart,
                                   static_cast<int>(g.batch), compute, CUBLAS_GEMM_DEFAULT),
        "a matrix product");
}

}  // namespace restage::cuda
