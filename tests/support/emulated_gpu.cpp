#include "tests/support/emulated_gpu.h"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>
#include <vector>

// A program with a GPU holds the kernels a second time.
#define cuda emulated_cuda
#include "autograd/cuda/attention.cu"
#include "autograd/cuda/deform.cu"
#include "autograd/cuda/elementwise.cu"
#include "autograd/cuda/gemm.h"
#include "autograd/cuda/indices.cu"
#include "autograd/cuda/layout.cu"
#include "autograd/cuda/matmul.cu"
#include "autograd/cuda/modulate.cu"
#include "autograd/cuda/norm.cu"
#include "autograd/cuda/points.cu"
#include "autograd/cuda/pooled_norm.cu"
#include "autograd/cuda/recurrent.cu"
#include "autograd/cuda/reduce.cu"
#include "autograd/cuda/rotation.cu"
#include "autograd/cuda/skeleton.cu"
#include "autograd/cuda/swing.cu"
#include "autograd/cuda/update.cu"

namespace restage {
namespace cuda {
namespace {

/// An operand with as many bits as a precision leaves it; the others are cut off.
template <class T>
T rounded(T x, MatmulPrecision precision) {
  if (!std::is_same_v<T, float> || precision == MatmulPrecision::float32) return x;
  const auto bits = std::bit_cast<uint32_t>(static_cast<float>(x));
  return std::bit_cast<float>(bits & ~0x1fffu);
}

template <class T>
void multiply_columns(const Gemm& g) {
  for (int64_t s = 0; s < g.batch; ++s) {
    const T *a = static_cast<const T*>(g.a) + s * g.a_apart,
            *b = static_cast<const T*>(g.b) + s * g.b_apart;
    T* c = static_cast<T*>(g.c) + s * g.c_apart;
    for (int64_t column = 0; column < g.n; ++column)
      for (int64_t row = 0; row < g.m; ++row) {
        T total = 0;
        for (int64_t i = 0; i < g.k; ++i)
          total +=
              rounded(a[g.transpose_a ? row * g.a_columns_apart + i : i * g.a_columns_apart + row],
                      g.precision) *
              rounded(b[g.transpose_b ? i * g.b_columns_apart + column
                                      : column * g.b_columns_apart + i],
                      g.precision);
        T& to = c[column * g.c_columns_apart + row];
        to = g.beta == 0 ? total : static_cast<T>(g.beta) * to + total;
      }
  }
}

}  // namespace

/// What cuBLAS does, in order.
void multiply(const Gemm& g) {
  g.type == DType::f64 ? multiply_columns<double>(g) : multiply_columns<float>(g);
}

/// Of a GPU with few processors, so that a group has several units of a recurrent layer.
RoundsLimits rounds_limits() { return {.groups = 3, .bytes = 1 << 16}; }

/// A stable sort, as the GPU's is.
void sort_by_key(Tensor& keys, Tensor& values, int64_t) {
  std::vector<std::pair<int32_t, int32_t>> pairs;
  int32_t *key = at<int32_t>(keys), *value = at<int32_t>(values);
  for (int64_t i = 0; i < keys.numel(); ++i) pairs.emplace_back(key[i], value[i]);
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (size_t i = 0; i < pairs.size(); ++i) std::tie(key[i], value[i]) = pairs[i];
}

}  // namespace cuda

namespace {

class EmulatedGpu final : public GuardedBackend {
 public:
  EmulatedGpu() : GuardedBackend("emulated gpu") {
#define RESTAGE_ENTER(kernel, Args) add<Args, cuda::kernel>();
    RESTAGE_KERNELS(RESTAGE_ENTER)
#undef RESTAGE_ENTER
  }

 private:
  void run_kernel(std::type_index args_type, const void* args) override {
    run_own(args_type, args);
  }
  std::string take_fault() override { return cuda::take_index_fault(); }
};

EmulatedGpu& gpu() {
  static EmulatedGpu* instance = new EmulatedGpu;
  return *instance;
}

}  // namespace

Device emulated_gpu() { return gpu().device(); }
DeviceCounts emulated_counts() { return gpu().counts; }

}  // namespace restage
#undef cuda
