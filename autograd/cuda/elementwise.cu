// One thread a number. All of these are bound by memory, so a switch over the operation, which is
// the same for all threads, costs nothing.
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/philox.h"
#include "autograd/kernels/binary_values.h"

namespace restage::cuda {
namespace {

// What the rows of unary_rows.h are written in, beside what the language has.
template <class T>
RESTAGE_DEVICE T abs(T x) {
  return fabs(x);
}
template <class T>
RESTAGE_DEVICE T sigmoid(T x) {
  const T e = exp(-fabs(x));
  return x >= T(0) ? T(1) / (T(1) + e) : e / (T(1) + e);
}
template <class T>
RESTAGE_DEVICE T softplus(T x) {
  return (x > T(0) ? x : T(0)) + log1p(exp(-fabs(x)));
}
template <class T>
RESTAGE_DEVICE T where(bool condition, T a, T b) {
  return condition ? a : b;
}

#define RESTAGE_CASE(name, help, kept, domain, value, gradient) \
  RESTAGE_CASE_WITH_NUMBER(name, number, 0, help, kept, domain, value, gradient)

template <class T>
RESTAGE_DEVICE T value_of(Unary op, T x, T of_op) {
  [[maybe_unused]] const T zero = 0, one = 1;
  switch (op) {
#define RESTAGE_CASE_WITH_NUMBER(name, number, tried, help, kept, domain, value, gradient) \
  case Unary::name: {                                                                      \
    [[maybe_unused]] const T number = of_op;                                               \
    return value;                                                                          \
  }
    RESTAGE_UNARY(RESTAGE_CASE)
    RESTAGE_UNARY_WITH_NUMBER(RESTAGE_CASE_WITH_NUMBER)
#undef RESTAGE_CASE_WITH_NUMBER
  }
  return x;
}

/// g f'(x) from what is kept, which the rows call x or y.
template <class T>
RESTAGE_DEVICE T slope_times(Unary op, T of, T g, T of_op) {
  [[maybe_unused]] const T zero = 0, one = 1, x = of, y = of;
  switch (op) {
#define RESTAGE_CASE_WITH_NUMBER(name, number, tried, help, kept, domain, value, gradient) \
  case Unary::name: {                                                                      \
    [[maybe_unused]] const T number = of_op;                                               \
    return gradient;                                                                       \
  }
    RESTAGE_UNARY(RESTAGE_CASE)
    RESTAGE_UNARY_WITH_NUMBER(RESTAGE_CASE_WITH_NUMBER)
#undef RESTAGE_CASE_WITH_NUMBER
  }
  return g;
}
#undef RESTAGE_CASE

/// Where the numbers of a broadcast operand lie: steps of its axes, 0 where it is repeated.
struct Steps {
  int rank = 0;
  int64_t size[Shape::kMaxRank] = {}, step[Shape::kMaxRank] = {};
  Steps(const Shape& of, const Shape& to) : rank(to.rank()) {
    int64_t stride = 1;
    for (int i = rank - 1; i >= 0; --i) {
      const int own = i - (rank - of.rank());
      const int64_t n = own < 0 ? 1 : of[own];
      size[i] = to[i];
      step[i] = n == 1 ? 0 : stride;
      stride *= n;
    }
  }
  RESTAGE_DEVICE int64_t at(int64_t i) const {
    int64_t offset = 0;
    for (int axis = rank - 1; axis >= 0; --axis) {
      offset += i % size[axis] * step[axis];
      i /= size[axis];
    }
    return offset;
  }
};

template <class T>
void unary_of(const UnaryArgs& args) {
  const T *x = at<T>(args.x), number = static_cast<T>(args.number);
  T* out = at<T>(args.out);
  const Unary op = args.op;
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) { out[i] = value_of(op, x[i], number); });
}

template <class T>
void unary_grad_of(const UnaryGradArgs& args) {
  const T *kept = at<T>(args.kept), *g = at<T>(args.gy), number = static_cast<T>(args.number);
  T* out = at<T>(args.out);
  const Unary op = args.op;
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    out[i] = slope_times(op, kept == nullptr ? T(0) : kept[i], g[i], number);
  });
}

/// f(x, y), or the gradient of one of its numbers from g = dL/df: `input` 0 or 1.
template <class T>
RESTAGE_DEVICE T value_or_gradient(Binary op, int input, T g, T x, T y) {
  switch (op) {
#define RESTAGE_CASE(name, ...)                          \
  case Binary::name: {                                   \
    using Row = binary_values::Row<Binary::name>;        \
    if (input == 0) return Row::template by<0>(g, x, y); \
    if (input == 1) return Row::template by<1>(g, x, y); \
    return Row::value(x, y);                             \
  }
    RESTAGE_BINARY(RESTAGE_CASE)
#undef RESTAGE_CASE
  }
  return g;
}

/// Most operands have the result's shape, or one number for each of its last axis. g is read for
/// gradients alone.
template <class T>
void combine(Binary op, int input, const Tensor& of_a, const Tensor& of_b, const T* g, Tensor& to) {
  const T *a = at<T>(of_a), *b = at<T>(of_b);
  T* out = at<T>(to);
  const int64_t n = to.numel();
  if (n == 0) return;
  if (of_a.numel() == n && of_b.numel() == n)
    return each(n, [=] RESTAGE_DEVICE(int64_t i) {
      out[i] = value_or_gradient(op, input, g == nullptr ? T(0) : g[i], a[i], b[i]);
    });
  const int64_t width = to.rank() > 0 ? to.size(-1) : 1;
  if (of_a.numel() == n && of_b.numel() == width && of_b.size(-1) == width)
    return rows(n / width, width, [=] RESTAGE_DEVICE(int64_t row, int64_t c) {
      const int64_t i = row * width + c;
      out[i] = value_or_gradient(op, input, g == nullptr ? T(0) : g[i], a[i], b[c]);
    });
  const Steps at_a(of_a.shape(), to.shape()), at_b(of_b.shape(), to.shape());
  each(n, [=] RESTAGE_DEVICE(int64_t i) {
    const T x = a[at_a.at(i)], y = b[at_b.at(i)];
    out[i] = value_or_gradient(op, input, g == nullptr ? T(0) : g[i], x, y);
  });
}

template <class T>
void binary_of(const BinaryArgs& args) {
  combine<T>(args.op, -1, args.a, args.b, nullptr, args.out);
}
template <class T>
void binary_grad_of(const BinaryGradArgs& args) {
  combine<T>(args.op, args.input, args.a ? *args.a : args.gy, args.b ? *args.b : args.gy,
             at<T>(args.gy), args.out);
}

template <class T>
void accumulate_of(const AccumulateArgs& args) {
  const T* a = at<T>(args.a);
  T* out = at<T>(args.out);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) { out[i] += a[i]; });
}

template <class T>
void expand_of(const ExpandArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const Steps of(args.x.shape(), args.out.shape());
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) { out[i] = x[of.at(i)]; });
}

/// The CPU's masks: the four words of a draw are those of four neighbours.
template <class T>
void dropout_of(const DropoutArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const RngKey key = args.key;
  const auto limit = static_cast<uint32_t>(args.p * 4294967296.0);
  const T kept = static_cast<T>(1.0 / (1.0 - args.p));
  const bool relu = args.relu;
  const int64_t n = args.out.numel();
  each((n + 3) / 4, [=] RESTAGE_DEVICE(int64_t draw) {
    const Words words = philox_words(key.seed, key.stream, static_cast<uint64_t>(draw));
    for (int64_t k = 0; k < 4 && 4 * draw + k < n; ++k) {
      const T v = x[4 * draw + k];
      out[4 * draw + k] = words.at[k] < limit || (relu && v <= T(0)) ? T(0) : v * kept;
    }
  });
}

template <class T>
void relu_dropout_grad_of(const ReluDropoutGradArgs& args) {
  const T *y = at<T>(args.y), *g = at<T>(args.gy), kept = static_cast<T>(1.0 / (1.0 - args.p));
  T* out = at<T>(args.out);
  each(args.out.numel(),
       [=] RESTAGE_DEVICE(int64_t i) { out[i] = y[i] <= T(0) ? T(0) : g[i] * kept; });
}

/// Every thread that finds such a number writes the same.
template <class T>
void non_finite_of(const NonFiniteArgs& args) {
  const T* x = at<T>(args.x);
  int32_t* out = at<int32_t>(args.out);
  each(1, [=] RESTAGE_DEVICE(int64_t) { out[0] = 0; });
  each(args.x.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    if (x[i] - x[i] != T(0)) out[0] = 1;
  });
}

template <class From, class To>
void cast_from_to(const CastArgs& args) {
  const From* x = at<From>(args.x);
  To* out = at<To>(args.out);
  each(args.out.numel(),
       [=] RESTAGE_DEVICE(int64_t i) { out[i] = static_cast<To>(static_cast<double>(x[i])); });
}

template <class From>
void cast_from(const CastArgs& args) {
  switch (args.out.dtype()) {
    case DType::f32:
      return cast_from_to<From, float>(args);
    case DType::f64:
      return cast_from_to<From, double>(args);
    case DType::i32:
      return cast_from_to<From, int32_t>(args);
    case DType::i64:
      return cast_from_to<From, int64_t>(args);
  }
}

}  // namespace

void unary(const UnaryArgs& args) { RESTAGE_FLOATS(args.out.dtype(), unary_of, args) }
void unary_grad(const UnaryGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), unary_grad_of, args) }
void binary(const BinaryArgs& args) { RESTAGE_FLOATS(args.out.dtype(), binary_of, args) }
void binary_grad(const BinaryGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), binary_grad_of, args)
}
void accumulate(const AccumulateArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), accumulate_of, args)
}
void expand(const ExpandArgs& args) { RESTAGE_FLOATS(args.out.dtype(), expand_of, args) }
void dropout(const DropoutArgs& args) { RESTAGE_FLOATS(args.out.dtype(), dropout_of, args) }
void relu_dropout_grad(const ReluDropoutGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), relu_dropout_grad_of, args)
}
void non_finite(const NonFiniteArgs& args) { RESTAGE_FLOATS(args.x.dtype(), non_finite_of, args) }

void cast(const CastArgs& args) {
  switch (args.x.dtype()) {
    case DType::f32:
      return cast_from<float>(args);
    case DType::f64:
      return cast_from<double>(args);
    case DType::i32:
      return cast_from<int32_t>(args);
    case DType::i64:
      return cast_from<int64_t>(args);
  }
}

}  // namespace restage::cuda
