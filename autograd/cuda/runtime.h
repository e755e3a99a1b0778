// The GPU's stream, and errors that come late: nvcc only.
#pragma once

#include <cublas_v2.h>
#include <cuda_runtime.h>

namespace restage::cuda {

/// Error naming what was done and what CUDA says.
void check(cudaError_t code, const char* what);
void check(cublasStatus_t code, const char* what);
/// After a launch: whether it could be made. What the kernel does wrong comes with synchronise().
void launched();
/// In the order of which everything happens.
cudaStream_t stream();
cublasHandle_t cublas();

}  // namespace restage::cuda
