// Moving numbers, a thread for each of the result.
#include "autograd/cuda/indices.h"
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
void copy_blocks_of(const CopyBlocksArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t count = args.count, xs = args.x_stride, xo = args.x_offset, os = args.out_stride,
                oo = args.out_offset;
  const bool add = args.add;
  each(args.outer * count, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t o = k / count, i = k % count;
    const T value = x[o * xs + xo + i];
    T& to = out[o * os + oo + i];
    to = add ? to + value : value;
  });
}

struct Axes {
  int64_t size[Shape::kMaxRank], step[Shape::kMaxRank];
};

template <class T>
void permute_of(const PermuteArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  Axes axes{};
  const int rank = args.out.rank();
  for (int i = 0; i < rank; ++i) {
    axes.size[i] = args.out.size(i);
    axes.step[i] = args.x.shape().product(args.order[i] + 1, rank);
  }
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t k) {
    int64_t rest = k, offset = 0;
    for (int i = rank - 1; i >= 0; --i) {
      offset += rest % axes.size[i] * axes.step[i];
      rest /= axes.size[i];
    }
    out[k] = x[offset];
  });
}

template <class T>
void gather_of(const GatherArgs& args) {
  look_at(args.index, args.x.size(1));
  const T* x = at<T>(args.x);
  const int32_t* index = at<int32_t>(args.index);
  T* out = at<T>(args.out);
  const int64_t v = args.x.size(1), c = args.x.size(2), m = args.index.size(1);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t row = k / c, from = index[row];
    out[k] = from >= 0 && from < v ? x[(row / m * v + from) * c + k % c] : T(0);
  });
}

template <class T>
void scatter_add_of(const ScatterAddArgs& args) {
  look_at(args.index, args.out.size(1));
  const Askers askers = askers_of(args.index, args.out.size(1));
  const AskersAt rows(askers);
  const T* g = at<T>(args.gy);
  T* out = at<T>(args.out);
  const int64_t c = args.out.size(2);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t k) {
    out[k] = static_cast<T>(
        rows.sum(k / c, [&](int64_t row) { return static_cast<double>(g[row * c + k % c]); }));
  });
}

template <class T>
void unfold_of(const UnfoldArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t l = args.x.size(1), c = args.x.size(2), steps = args.out.size(1), width = args.k,
                stride = args.stride, pad = args.pad_left;
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t tap = k % width, channel = k / width % c, step = k / (width * c) % steps,
                  s = k / (width * c * steps), place = step * stride - pad + tap;
    out[k] = place >= 0 && place < l ? x[(s * l + place) * c + channel] : T(0);
  });
}

template <class T>
void fold_of(const FoldArgs& args) {
  const T* g = at<T>(args.gy);
  T* out = at<T>(args.out);
  const int64_t l = args.out.size(1), c = args.out.size(2), steps = args.gy.size(1), width = args.k,
                stride = args.stride, pad = args.pad_left;
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t channel = k % c, place = k / c % l, s = k / (c * l);
    double total = 0;
    for (int64_t tap = 0; tap < width; ++tap) {
      const int64_t from = place + pad - tap;
      if (from < 0 || from % stride != 0 || from / stride >= steps) continue;
      total += static_cast<double>(g[((s * steps + from / stride) * c + channel) * width + tap]);
    }
    out[k] = static_cast<T>(total);
  });
}

}  // namespace

/// Whatever the numbers are, of their width.
void copy_blocks(const CopyBlocksArgs& args) {
  switch (args.out.dtype()) {
    case DType::f32:
      return copy_blocks_of<float>(args);
    case DType::f64:
      return copy_blocks_of<double>(args);
    case DType::i32:
      return copy_blocks_of<int32_t>(args);
    case DType::i64:
      return copy_blocks_of<int64_t>(args);
  }
}
void permute(const PermuteArgs& args) { RESTAGE_FLOATS(args.out.dtype(), permute_of, args) }
void gather(const GatherArgs& args) { RESTAGE_FLOATS(args.out.dtype(), gather_of, args) }
void scatter_add(const ScatterAddArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), scatter_add_of, args)
}
void unfold(const UnfoldArgs& args) { RESTAGE_FLOATS(args.out.dtype(), unfold_of, args) }
void fold(const FoldArgs& args) { RESTAGE_FLOATS(args.out.dtype(), fold_of, args) }

}  // namespace restage::cuda
