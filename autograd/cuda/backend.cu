// One GPU, one stream: kernels, copies and memory in the order of the program.
#include "autograd/cuda/kernels.h"

#include <string>

namespace restage {
namespace cuda {

namespace {

/// What is made once and stays for good, like the host's pool.
struct Runtime {
  Runtime() {
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreate");
    cudaMemPool_t pool;
    check(cudaDeviceGetDefaultMemPool(&pool, 0), "cudaDeviceGetDefaultMemPool");
    uint64_t keep_all = UINT64_MAX;  // a step needs again what the last one gave back
    check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep_all),
          "cudaMemPoolSetAttribute");
    check(cublasCreate(&cublas), "cublasCreate");
    check(cublasSetStream(cublas, stream), "cublasSetStream");
    // Bits must not depend on what else runs: no atomics.
    check(cublasSetAtomicsMode(cublas, CUBLAS_ATOMICS_NOT_ALLOWED), "cublasSetAtomicsMode");
  }
  cudaStream_t stream;
  cublasHandle_t cublas;
};

Runtime& runtime() {
  static Runtime* instance = new Runtime;
  return *instance;
}

}  // namespace

void check(cudaError_t code, const char* what) {
  if (code != cudaSuccess)
    throw Error(std::string("the GPU failed in ") + what + " (" + running_op() +
                "): " + cudaGetErrorString(code));
}

void check(cublasStatus_t code, const char* what) {
  if (code != CUBLAS_STATUS_SUCCESS)
    throw Error(std::string("the GPU failed in ") + what + " (" + running_op() +
                "): " + cublasGetStatusString(code));
}

void launched() { check(cudaGetLastError(), "a launch"); }
cudaStream_t stream() { return runtime().stream; }
cublasHandle_t cublas() { return runtime().cublas; }

namespace {

class CudaBackend final : public Backend {
 public:
  CudaBackend() {
#define RESTAGE_ENTER(kernel, Args) add<Args, cuda::kernel>();
    RESTAGE_CUDA_KERNELS(RESTAGE_ENTER)
#undef RESTAGE_ENTER
  }
  std::string_view name() const override { return "cuda"; }
  void* allocate(size_t bytes) override {
    void* data = nullptr;
    check(cudaMallocAsync(&data, std::max<size_t>(bytes, 1), stream()), "cudaMallocAsync");
    return data;
  }
  void release(void* data, size_t) override { cudaFreeAsync(data, stream()); }
  void fill_zero(void* data, size_t bytes) override {
    check(cudaMemsetAsync(data, 0, bytes, stream()), "cudaMemset");
  }
  /// From memory that is not pinned the call returns when the numbers were read.
  void copy_in(void* to, const void* from, size_t bytes) override {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, stream()), "a copy to the GPU");
  }
  void copy(void* to, const void* from, size_t bytes) override {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream()), "a copy");
  }
  void copy_out(void* to, const void* from, size_t bytes) override {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream()),
          "a copy from the GPU");
    synchronise();
  }
  void synchronise() override {
    check(cudaStreamSynchronize(stream()), "what was launched");
    if (const std::string fault = take_index_fault(); !fault.empty()) throw Error(fault);
  }
};

}  // namespace
}  // namespace cuda

bool add_cuda_device() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) return false;
  static auto* backend = new cuda::CudaBackend;
  add_device(*backend);
  return true;
}

}  // namespace restage
