#include <algorithm>
#include <cstring>

#include "autograd/base/parallel_each.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {
namespace {

/// Calls f with the numbers of the tensor, whatever its dtype.
template <class F>
void with_numbers(DType type, F&& f) {
  switch (type) {
    case DType::f32:
      return f(float{});
    case DType::f64:
      return f(double{});
    case DType::i32:
      return f(int32_t{});
    case DType::i64:
      return f(int64_t{});
  }
}

void add_blocks(const CopyBlocksArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    // One long block is cut, too.
    const int64_t piece = std::min(args.count, kGrain), pieces = (args.count + piece - 1) / piece;
    parallel_each(args.outer * pieces, row_grain(piece), [&](int64_t k) {
      const int64_t o = k / pieces, from = k % pieces * piece;
      const T* x = args.x.data<T>() + o * args.x_stride + args.x_offset;
      T* out = args.out.data<T>() + o * args.out_stride + args.out_offset;
      for (int64_t i = from; i < std::min(args.count, from + piece); ++i) out[i] += x[i];
    });
  });
}

}  // namespace

void cast(const CastArgs& args) {
  with_numbers(args.x.dtype(), [&](auto from) {
    with_numbers(args.out.dtype(), [&](auto to) {
      const auto* x = args.x.data<decltype(from)>();
      auto* out = args.out.data<decltype(to)>();
      for (int64_t i = 0; i < args.x.numel(); ++i)
        out[i] = static_cast<decltype(to)>(static_cast<double>(x[i]));
    });
  });
}

void copy_blocks(const CopyBlocksArgs& args) {
  const auto width = static_cast<int64_t>(size_of(args.out.dtype()));
  const char* x = static_cast<const char*>(args.x.bytes());
  char* out = static_cast<char*>(args.out.bytes());
  if (args.count == 0) return;
  if (args.add) return add_blocks(args);
  parallel_each(args.outer, row_grain(args.count), [&](int64_t o) {
    std::memcpy(out + (o * args.out_stride + args.out_offset) * width,
                x + (o * args.x_stride + args.x_offset) * width,
                static_cast<size_t>(args.count * width));
  });
}

void permute(const PermuteArgs& args) {
  const int rank = args.out.rank();
  std::array<int64_t, Shape::kMaxRank> step{};  // of x, in the order of out's axes
  for (int i = 0; i < rank; ++i) step[i] = args.x.shape().product(args.order[i] + 1, rank);
  if (args.out.numel() == 0) return;
  if (rank == 0) return copy_blocks({args.x, args.out, 1, 1, 1, 0, 1, 0});
  const int64_t inner = args.out.size(rank - 1), inner_step = step[rank - 1];
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    T* out = args.out.data<T>();
    parallel_each(args.out.numel() / inner, row_grain(inner), [&](int64_t row) {
      int64_t rest = row, offset = 0;
      for (int i = rank - 2; i >= 0; --i) {
        offset += rest % args.out.size(i) * step[i];
        rest /= args.out.size(i);
      }
      const T* from_x = x + offset;
      T* to_out = out + row * inner;
      if (inner_step == 1) {
        std::memcpy(to_out, from_x, static_cast<size_t>(inner) * sizeof(T));
      } else {
        for (int64_t i = 0; i < inner; ++i) to_out[i] = from_x[i * inner_step];
      }
    });
  });
}

void gather(const GatherArgs& args) {
  const int64_t v = args.x.size(1), c = args.x.size(2), m = args.index.size(1);
  const int32_t* index = args.index.data<int32_t>();
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    T* out = args.out.data<T>();
    parallel_each(args.x.size(0) * m, row_grain(c), [&](int64_t row) {
      std::copy_n(x + (row / m * v + index[row]) * c, c, out + row * c);
    });
  });
}

void scatter_add(const ScatterAddArgs& args) {
  // Threads split samples and channels, never the rows of one target, so sums keep their order.
  const int64_t n = args.out.size(0), v = args.out.size(1), c = args.out.size(2),
                m = args.index.size(1);
  const int32_t* index = args.index.data<int32_t>();
  const int64_t strip = 64, strips = (c + strip - 1) / strip;
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* gy = args.gy.data<T>();
    T* out = args.out.data<T>();
    parallel_each(n * strips, 1, [&](int64_t t) {
      const int64_t s = t / strips, c0 = t % strips * strip, width = std::min(strip, c - c0);
      for (int64_t p = 0; p < v; ++p) std::fill_n(out + (s * v + p) * c + c0, width, T(0));
      for (int64_t r = 0; r < m; ++r) {
        T* target = out + (s * v + index[s * m + r]) * c + c0;
        const T* row = gy + (s * m + r) * c + c0;
        for (int64_t i = 0; i < width; ++i) target[i] += row[i];
      }
    });
  });
}

void unfold(const UnfoldArgs& args) {
  const int64_t l = args.x.size(1), c = args.x.size(2), steps = args.out.size(1), k = args.k;
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.x.size(0) * steps, row_grain(c * k), [&](int64_t row) {
      const T* x = args.x.data<T>() + row / steps * l * c;
      T* out = args.out.data<T>() + row * c * k;
      for (int64_t j = 0; j < k; ++j) {
        const int64_t at = row % steps * args.stride - args.pad_left + j;
        const bool inside = at >= 0 && at < l;
        for (int64_t i = 0; i < c; ++i) out[i * k + j] = inside ? x[at * c + i] : T(0);
      }
    });
  });
}

void fold(const FoldArgs& args) {
  const int64_t l = args.out.size(1), c = args.out.size(2), steps = args.gy.size(1), k = args.k;
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.out.size(0), 1, [&](int64_t s) {
      T* out = args.out.data<T>() + s * l * c;
      std::fill_n(out, l * c, T(0));
      for (int64_t step = 0; step < steps; ++step) {
        const T* gy = args.gy.data<T>() + (s * steps + step) * c * k;
        for (int64_t j = 0; j < k; ++j) {
          const int64_t at = step * args.stride - args.pad_left + j;
          if (at < 0 || at >= l) continue;
          for (int64_t i = 0; i < c; ++i) out[at * c + i] += gy[i * k + j];
        }
      }
    });
  });
}

}  // namespace restage::cpu
