// What optimisers do: one launch for all tensors of a list.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

constexpr int64_t kPart = 1 << 12;  ///< numbers that a group of threads goes through

/// Tensors of one launch, cut into parts of kPart numbers. A kernel gets it by value: CUDA gives
/// its arguments 32,764 bytes.
template <class One>
struct Table {
  static constexpr int kMost = 256;
  One one[kMost];
  int64_t size[kMost], first[kMost + 1] = {0};  ///< numbers; the first part, of all parts
  int count = 0;

  void add(const One& x, int64_t numbers) {
    one[count] = x;
    size[count] = numbers;
    first[count + 1] = first[count] + (numbers + kPart - 1) / kPart;
    ++count;
  }
  int64_t parts() const { return first[count]; }
  /// Whose part it is.
  RESTAGE_DEVICE int of(int64_t part) const {
    int low = 0, high = count;
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      (first[middle] <= part ? low : high) = middle;
    }
    return low;
  }
};

const Tensor& sized(const Tensor& x) { return x; }
const Tensor& sized(const MixArgs::Of& x) { return x.out; }
const Tensor& sized(const AdamArgs::Of& x) { return x.out; }

/// Tables of what `of` says of those tensors of a list that hold T.
template <class T, class One, class List, class F>
std::vector<Table<One>> tables(const List& list, F of) {
  std::vector<Table<One>> out;
  for (const auto& x : list) {
    if (sized(x).dtype() != DTypeOf<T>::value) continue;
    if (out.empty() || out.back().count == Table<One>::kMost) out.emplace_back();
    out.back().add(of(x), sized(x).numel());
  }
  return out;
}

/// f(entry, i) for all numbers i of all tensors of a table, each in a thread of its own.
template <class One, class F>
void each_of(const Table<One>& table, F f) {
  groups(table.parts(), [=] RESTAGE_DEVICE(const Group& g, int64_t part) {
    const int k = table.of(part);
    const int64_t from = (part - table.first[k]) * kPart, left = table.size[k] - from;
    g.each(left < kPart ? left : kPart, [&](int64_t i) { f(table.one[k], from + i); });
  });
}

template <class T>
struct Summed {
  const T* x;
  double* out;
};

template <class T>
void squared_norm_of(const SquaredNormArgs& args) {
  double* out = at<double>(args.out);
  const Tensor* first = args.all.data();
  for (const auto& table : tables<T, Summed<T>>(args.all, [&](const Tensor& x) {
         return Summed<T>{at<T>(x), out + (&x - first)};
       })) {
    const Tensor room = scratch(args.out, table.parts());
    double* sums = at<double>(room);
    groups(table.parts(), [=] RESTAGE_DEVICE(const Group& g, int64_t part) {
      const int k = table.of(part);
      const int64_t from = (part - table.first[k]) * kPart, left = table.size[k] - from;
      const T* x = table.one[k].x + from;
      const double total = g.sum(left < kPart ? left : kPart, [&](int64_t i) {
        return static_cast<double>(x[i]) * static_cast<double>(x[i]);
      });
      g.each(1, [&](int64_t) { sums[part] = total; });
    });
    groups(table.count, [=] RESTAGE_DEVICE(const Group& g, int64_t k) {
      const double* of = sums + table.first[k];
      const double total =
          g.sum(table.first[k + 1] - table.first[k], [&](int64_t p) { return of[p]; });
      g.each(1, [&](int64_t) { *table.one[k].out = total; });
    });
  }
}

template <class T>
struct Moved {
  const T* gradient;
  T *w, *m, *v, step_size, root;
};

template <class T>
void adam_of(const AdamArgs& args) {
  const auto number = [](double x) { return static_cast<T>(x); };
  const T eps = number(args.eps), b1 = number(args.beta1), b2 = number(args.beta2),
          decay = number(args.weight_decay), gs = number(args.gradient_scale),
          keep = number(args.keep);
  const auto moved = [&](const AdamArgs::Of& x) {
    const double c1 = 1.0 - std::pow(args.beta1, static_cast<double>(x.step));
    const double c2 = 1.0 - std::pow(args.beta2, static_cast<double>(x.step));
    return Moved<T>{at<T>(x.gradient), at<T>(x.out),         at<T>(x.m),
                    at<T>(x.v),        number(args.lr / c1), number(1 / std::sqrt(c2))};
  };
  for (const auto& table : tables<T, Moved<T>>(args.all, moved))
    each_of(table, [=] RESTAGE_DEVICE(const Moved<T>& x, int64_t i) {
      const T w = keep * x.w[i], g = fma(x.gradient[i], gs, decay * w);
      const T m = fma(b1, x.m[i], (T(1) - b1) * g), v = fma(b2, x.v[i], (T(1) - b2) * (g * g));
      x.m[i] = m;
      x.v[i] = v;
      x.w[i] = w - x.step_size * m / fma(sqrt(v), x.root, eps);
    });
}

template <class T>
struct Mixed {
  const T* x;
  T* out;
};

template <class T>
void mix_of(const MixArgs& args) {
  const T keep = static_cast<T>(args.keep), add = static_cast<T>(args.add);
  const auto mixed = [](const MixArgs::Of& of) { return Mixed<T>{at<T>(of.x), at<T>(of.out)}; };
  for (const auto& table : tables<T, Mixed<T>>(args.all, mixed))
    each_of(table, [=] RESTAGE_DEVICE(const Mixed<T>& of, int64_t i) {
      of.out[i] = fma(keep, of.out[i], add * of.x[i]);
    });
}

}  // namespace

void squared_norm(const SquaredNormArgs& args) {
  squared_norm_of<float>(args);
  squared_norm_of<double>(args);
}
void adam(const AdamArgs& args) {
  adam_of<float>(args);
  adam_of<double>(args);
}
void mix(const MixArgs& args) {
  mix_of<float>(args);
  mix_of<double>(args);
}

}  // namespace restage::cuda
