// The form of the kernels of this folder: loops over numbers and over groups of threads. nvcc makes
// CUDA kernels of these; any other compiler makes loops of the host, in another order than a GPU
// would take on purpose, which is how tests run them where there is no GPU (tests/support).
//
// A kernel is a function of a contract (autograd/kernels) that takes addresses out of tensors and
// calls each() or groups(). Inside a group, what one thread leaves for another lies in memory that
// they share, and is read after the each() or sum() that wrote it: all threads meet there.
#pragma once

#include <math.h>  // exp, fma and others for float as well, by the names that nvcc knows

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/module_path.h"
#include "autograd/kernels/kernel.h"

#ifdef __CUDACC__
#include <cooperative_groups.h>

#include "autograd/cuda/runtime.h"
#define RESTAGE_DEVICE __device__
#define RESTAGE_UNROLL _Pragma("unroll")  // arrays stay in registers
#else
#define RESTAGE_DEVICE
#define RESTAGE_UNROLL
#endif

namespace restage::cuda {

inline constexpr int kThreads = 256;  ///< of a group

/// Calls f<float>() or f<double>() by dtype. nvcc wants no generic lambda around a kernel.
#define RESTAGE_FLOATS(type, function, args)                                             \
  switch (type) {                                                                        \
    case DType::f32:                                                                     \
      return function<float>(args);                                                      \
    case DType::f64:                                                                     \
      return function<double>(args);                                                     \
    default:                                                                             \
      throw Error(std::string("kernel of the GPU has no variant for ") + name_of(type)); \
  }

/// The numbers of a tensor as kernels see them. Error if the tensor is in the host's memory.
template <class T>
T* at(const Tensor& t) {
#ifdef __CUDACC__
  if (t.defined() && t.device() == Device{})
    throw Error("a kernel of the GPU was given memory of the host (" + running_op() + ")");
  return static_cast<T*>(const_cast<void*>(t.address()));
#else
  return const_cast<Tensor&>(t).data<T>();
#endif
}
template <class T>
T* at(const Tensor* t) {
  return t == nullptr ? nullptr : at<T>(*t);
}

/// Doubles for the time of a kernel.
inline Tensor scratch(const Tensor& like, int64_t count) {
  return Tensor::empty({count}, DType::f64, like.device());
}

/// Several sums at once.
template <int N>
struct Sums {
  static constexpr int kCount = N;
  double of[N] = {};
  RESTAGE_DEVICE void operator+=(const Sums& b) {
    for (int k = 0; k < N; ++k) of[k] += b.of[k];
  }
};

/// "Sum" of numbers that is the largest of them and where it is: the first of equal ones; NaN is
/// larger than all others.
template <class T>
struct Largest {
  T value = -INFINITY;
  int32_t index = INT32_MAX;
  RESTAGE_DEVICE void operator+=(const Largest& b) {
    const bool nan = value != value, other = b.value != b.value;
    const bool equal = nan ? other : value == b.value;
    if (equal ? b.index < index : !nan && (other || b.value > value)) *this = b;
  }
};

/// Threads that work on one thing together.
struct Group {
#ifdef __CUDACC__
  /// f(i) for all i below n; all threads meet before and after.
  template <class F>
  __device__ void each(int64_t n, F f) const {
    __syncthreads();
    for (int64_t i = threadIdx.x; i < n; i += blockDim.x) f(i);
    __syncthreads();
  }
#else
  template <class F>
  void each(int64_t n, F f) const {
    for (int64_t i = n; i-- > 0;) f(i);
  }
#endif
  /// The f(i) of all i below n added up by +=, from S() on, in an order that n alone decides. All
  /// threads get the sum.
  template <class S = double, class F>
  RESTAGE_DEVICE S sum(int64_t n, F f) const {
    if constexpr (sizeof(S) > kRoom) {  // Sums, one after the other
      S out;
      RESTAGE_UNROLL
      for (int k = 0; k < S::kCount; ++k) out.of[k] = sum(n, [&](int64_t i) { return f(i).of[k]; });
      return out;
    } else {
      S* parts = reinterpret_cast<S*>(room);
      each(kThreads, [&](int64_t t) {
        S s{};
        for (int64_t i = t; i < n; i += kThreads) s += f(i);
        parts[t] = s;
      });
      for (int64_t half = kThreads / 2; half > 0; half /= 2)
        each(half, [&](int64_t t) { parts[t] += parts[t + half]; });
      const S total = parts[0];
      each(0, [](int64_t) {});  // no thread writes before all threads have read
      return total;
    }
  }
  static constexpr size_t kRoom = 2 * sizeof(double);  ///< of a thread
  double* room;                                        ///< 2 * kThreads numbers
};

#ifdef __CUDACC__

template <class F>
__global__ void each_kernel(int64_t n, F f) {
  const int64_t step = static_cast<int64_t>(gridDim.x) * blockDim.x;
  for (int64_t i = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += step)
    f(i);
}

template <class F>
__global__ void groups_kernel(int64_t n, F f) {
  __shared__ double room[2 * kThreads];
  for (int64_t i = blockIdx.x; i < n; i += gridDim.x) f(Group{room}, i);
}

/// Threads beside each other have columns beside each other.
template <class F>
__global__ void rows_kernel(int64_t n, int64_t width, F f) {
  const int64_t step = static_cast<int64_t>(gridDim.x) * blockDim.y;
  for (int64_t row = static_cast<int64_t>(blockIdx.x) * blockDim.y + threadIdx.y; row < n;
       row += step)
    for (int64_t column = threadIdx.x; column < width; column += blockDim.x) f(row, column);
}

extern __shared__ __align__(16) double kept_of_group[];

template <class F>
__global__ void rounds_kernel(int64_t rounds, F f) {
  __shared__ double room[2 * kThreads];
  for (int64_t round = 0; round < rounds; ++round) {
    f(Group{room}, kept_of_group, static_cast<int64_t>(blockIdx.x), round);
    cooperative_groups::this_grid().sync();
  }
}

inline unsigned grid(int64_t blocks) {
  return static_cast<unsigned>(std::min<int64_t>(blocks, 1 << 20));
}

/// f(i) for all i below n, each in a thread of its own.
template <class F>
void each(int64_t n, F f) {
  if (n == 0) return;
  each_kernel<<<grid((n + kThreads - 1) / kThreads), kThreads, 0, stream()>>>(n, f);
  launched();
}

/// f(row, column) for all of n rows of so many columns, each in a thread of its own: as each(), for
/// kernels that would divide by the width, which costs more than most of them do.
template <class F>
void rows(int64_t n, int64_t width, F f) {
  if (n == 0 || width == 0) return;
  unsigned across = 32;
  while (across < width && across < kThreads) across *= 2;
  const dim3 block(across, kThreads / across);
  rows_kernel<<<grid((n + block.y - 1) / block.y), block, 0, stream()>>>(n, width, f);
  launched();
}

/// f(group, i) for all i below n, each by a group of threads.
template <class F>
void groups(int64_t n, F f) {
  if (n == 0) return;
  groups_kernel<<<grid(n), kThreads, 0, stream()>>>(n, f);
  launched();
}

/// f(group, kept, i, round) for all i below n and round after round: all groups meet between two
/// rounds, and `kept`, so many bytes, stays with its group. n is at most rounds_limits().groups.
template <class F>
void rounds(int64_t n, int64_t count, int64_t bytes, F f) {
  if (n == 0 || count == 0) return;
  const auto kernel = &rounds_kernel<F>;
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             static_cast<int>(bytes)),
        "cudaFuncSetAttribute");
  void* args[] = {&count, &f};
  check(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(kernel),
                                    dim3(static_cast<unsigned>(n)), dim3(kThreads), args,
                                    static_cast<size_t>(bytes), stream()),
        "a launch");
}

#else

template <class F>
void rows(int64_t n, int64_t width, F f) {
  for (int64_t row = n; row-- > 0;)
    for (int64_t column = width; column-- > 0;) f(row, column);
}

template <class F>
void each(int64_t n, F f) {
  for (int64_t i = n; i-- > 0;) f(i);
}

template <class F>
void groups(int64_t n, F f) {
  double room[2 * kThreads];
  for (int64_t i = n; i-- > 0;) f(Group{room}, i);
}

template <class F>
void rounds(int64_t n, int64_t count, int64_t bytes, F f) {
  double room[2 * kThreads];
  const int64_t width = bytes / 16 * 2 + 2;  // each begins at a multiple of 16 bytes
  std::vector<double> kept(static_cast<size_t>(n * width));
  for (int64_t round = 0; round < count; ++round)
    for (int64_t i = n; i-- > 0;) f(Group{room}, kept.data() + i * width, i, round);
}

#endif

/// What rounds() can have: groups that run at once, and bytes that each may keep.
struct RoundsLimits {
  int64_t groups, bytes;
};
RoundsLimits rounds_limits();

}  // namespace restage::cuda
