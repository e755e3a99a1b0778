// One GPU, one stream: kernels, copies and memory in the order of the program.
#include "autograd/cuda/kernels.h"

#include <cstring>
#include <mutex>
#include <string>

#include "autograd/base/format.h"
#include "autograd/base/log.h"

namespace restage {
namespace cuda {

namespace {

/// What is made once and stays for good, like the host's pool.
struct Runtime {
  Runtime() {
    int count = 0;
    check(cudaGetDeviceCount(&count), "cudaGetDeviceCount");
    gpu = gpu_of(local_rank(), count);
    check(cudaSetDevice(gpu), "cudaSetDevice");
    if (count > 1) log_info(format("device 'cuda' is GPU %d of %d", gpu, count));
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreate");
    check(cudaDeviceGetDefaultMemPool(&pool, gpu), "cudaDeviceGetDefaultMemPool");
    uint64_t keep_all = UINT64_MAX;  // a step needs again what the last step gave back
    check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep_all),
          "cudaMemPoolSetAttribute");
    int processors = 0, bytes = 0;
    check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, gpu),
          "cudaDeviceGetAttribute");
    check(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, gpu),
          "cudaDeviceGetAttribute");
    constexpr int64_t kRoomOfGroups = 2 * kThreads * sizeof(double);
    limits = {processors, bytes - kRoomOfGroups};
    check(cublasCreate(&cublas), "cublasCreate");
    check(cublasSetStream(cublas, stream), "cublasSetStream");
    // Bits must not depend on what else runs: no atomics.
    check(cublasSetAtomicsMode(cublas, CUBLAS_ATOMICS_NOT_ALLOWED), "cublasSetAtomicsMode");
  }
  int gpu;
  cudaMemPool_t pool;
  cudaStream_t stream;
  cublasHandle_t cublas;
  RoundsLimits limits;
};

Runtime& runtime() {
  static Runtime* instance = new Runtime;
  // CUDA remembers the GPU of each thread by itself; a new thread begins with GPU 0.
  thread_local const bool chosen [[maybe_unused]] = [] {
    check(cudaSetDevice(instance->gpu), "cudaSetDevice");
    return true;
  }();
  return *instance;
}

/// Pinned memory through which copies to the GPU go: from there the GPU fetches them by itself,
/// when their turn in the stream comes, while the host goes on. Several threads copy.
class CopiesIn {
 public:
  /// Larger copies are weights that a training begins with: they go their own way, and may wait.
  static constexpr size_t kMost = size_t{4} << 20;

  void copy(void* to, const void* from, size_t bytes) {
    const cudaStream_t in_order = stream();  // chooses the GPU of a new thread, too
    const std::lock_guard lock(mutex_);
    Slot& slot = slots_[next_++ % kSlots];
    if (slot.data == nullptr) {
      check(cudaHostAlloc(&slot.data, kMost, cudaHostAllocDefault), "cudaHostAlloc");
      check(cudaEventCreateWithFlags(&slot.fetched, cudaEventDisableTiming), "cudaEventCreate");
    }
    check(cudaEventSynchronize(slot.fetched), "cudaEventSynchronize");  // of the copy before
    std::memcpy(slot.data, from, bytes);
    check(cudaMemcpyAsync(to, slot.data, bytes, cudaMemcpyHostToDevice, in_order),
          "a copy to the GPU");
    check(cudaEventRecord(slot.fetched, in_order), "cudaEventRecord");
  }

 private:
  static constexpr size_t kSlots = 16;  ///< a step's examples are a few tensors
  struct Slot {
    void* data = nullptr;
    cudaEvent_t fetched = nullptr;
  };
  Slot slots_[kSlots];
  size_t next_ = 0;
  std::mutex mutex_;
};

int64_t number_of(cudaMemPoolAttr what) {
  uint64_t bytes = 0;
  check(cudaMemPoolGetAttribute(runtime().pool, what, &bytes), "cudaMemPoolGetAttribute");
  return static_cast<int64_t>(bytes);
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
RoundsLimits rounds_limits() { return runtime().limits; }

namespace {

class CudaBackend final : public Backend {
 public:
  CudaBackend() {
#define RESTAGE_ENTER(kernel, Args) add<Args, cuda::kernel>();
    RESTAGE_KERNELS(RESTAGE_ENTER)
#undef RESTAGE_ENTER
  }
  std::string_view name() const override { return "cuda"; }
  void* allocate(size_t bytes) override {
    void* data = nullptr;
    const size_t size = std::max<size_t>(bytes, 1);
    if (cudaMallocAsync(&data, size, stream()) == cudaErrorMemoryAllocation) {
      cudaGetLastError();  // of this call
      trim();
      check(cudaMallocAsync(&data, size, stream()), "cudaMallocAsync");
    } else {
      check(cudaGetLastError(), "cudaMallocAsync");
    }
    return data;
  }
  void release(void* data, size_t) override { cudaFreeAsync(data, stream()); }
  void fill_zero(void* data, size_t bytes) override {
    check(cudaMemsetAsync(data, 0, bytes, stream()), "cudaMemset");
  }
  /// From memory that is not pinned CUDA's call returns when the numbers were read.
  void copy_in(void* to, const void* from, size_t bytes) override {
    static auto* pinned = new CopiesIn;
    if (bytes <= CopiesIn::kMost) return pinned->copy(to, from, bytes);
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
  bool works_later() const override { return true; }
  MemoryStats memory() const override {
    MemoryStats out;
    out.in_use = number_of(cudaMemPoolAttrUsedMemCurrent);
    out.peak = number_of(cudaMemPoolAttrUsedMemHigh);
    out.kept = number_of(cudaMemPoolAttrReservedMemCurrent) - out.in_use;
    return out;
  }
  void reset_peak() override {
    uint64_t none = 0;  // the only value that it takes
    check(cudaMemPoolSetAttribute(runtime().pool, cudaMemPoolAttrUsedMemHigh, &none),
          "cudaMemPoolSetAttribute");
  }
  void trim() override {
    check(cudaStreamSynchronize(stream()), "what was launched");  // what was freed is free then
    check(cudaMemPoolTrimTo(runtime().pool, 0), "cudaMemPoolTrimTo");
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
