// Products by cuBLAS; bias and activation in a pass of their own.
#include "autograd/cuda/gemm.h"
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
void finish(const MatmulArgs& args) {
  T* out = at<T>(args.out);
  const T* bias = at<T>(args.bias);
  const int64_t n = args.out.size(-1);
  const bool relu = args.activation == Activation::relu;
  rows(args.out.numel() / n, n, [=] RESTAGE_DEVICE(int64_t row, int64_t c) {
    T* to = out + row * n + c;
    const T v = bias == nullptr ? *to : *to + bias[c];
    *to = relu && v <= T(0) ? T(0) : v;
  });
}

/// Rows as columns: out^T = op(b)^T op(a)^T, and a matrix by rows is its transpose by columns.
template <class T>
void product_of(const MatmulArgs& args) {
  const Tensor &a = args.a, &b = args.b;
  const int64_t m = a.size(args.transpose_a ? -1 : -2), k = a.size(args.transpose_a ? -2 : -1),
                n = args.out.size(-1), batch = args.out.rank() == 3 ? args.out.size(0) : 1;
  if (args.out.numel() == 0) return;
  if (k == 0) {
    T* out = at<T>(args.out);
    if (!args.accumulate) each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) { out[i] = T(0); });
  } else {
    const auto apart = [](const Tensor& t) { return t.rank() == 3 ? t.size(1) * t.size(2) : 0; };
    multiply(
        {.transpose_a = args.transpose_b,
         .transpose_b = args.transpose_a,
         .m = n,
         .n = m,
         .k = k,
         .a = at<T>(b),
         .a_columns_apart = b.size(-1),
         .a_apart = apart(b),
         .b = at<T>(a),
         .b_columns_apart = a.size(-1),
         .b_apart = apart(a),
         .beta = args.accumulate ? 1.0 : 0.0,
         .c = at<T>(args.out),
         .c_columns_apart = n,
         .c_apart = m * n,
         .batch = batch,
         .type = args.out.dtype(),
         .precision = k < MatmulArgs::kLeastTerms ? MatmulPrecision::float32 : args.precision});
  }
  if (args.bias != nullptr || args.activation != Activation::none) finish<T>(args);
}

}  // namespace

void matmul(const MatmulArgs& args) { RESTAGE_FLOATS(args.out.dtype(), product_of, args) }

}  // namespace restage::cuda
