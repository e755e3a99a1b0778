// The GPU's stream, and errors that come late: nvcc only.
#pragma once

#include <cublas_v2.h>
#include <cuda_runtime.h>

namespace restage::cuda {

/// Error naming what was done and what CUDA says.
void check(cudaError_t code, const char* what);
void check(cublasStatus_t code, const char* what);
/// To be called after a launch; Error if it could not be made. What the kernel itself does wrong is
/// told by synchronise().
void launched();
/// The stream in which everything is launched, so that everything happens in order.
cudaStream_t stream();
cublasHandle_t cublas();

}  // namespace restage::cuda
