// Sizes and strides of the products that MatmulArgs ask for.
#pragma once

#include "autograd/kernels/matmul.h"

namespace restage::cpu {

/// `batch` products of a [m, k] and b [k, n], each element `row` and `col` numbers from the next in
/// its column and its row, each matrix `step` numbers from the one of the next product.
struct MatmulSizes {
  struct Matrix {
    int64_t row, col, step;
  };
  explicit MatmulSizes(const MatmulArgs& args) {
    const int ra = args.a.rank(), rb = args.b.rank(), ro = args.out.rank();
    m = args.out.size(ro - 2);
    n = args.out.size(ro - 1);
    k = args.a.size(args.transpose_a ? ra - 2 : ra - 1);
    batch = args.out.shape().product(0, ro - 2);
    a = {args.transpose_a ? 1 : k, args.transpose_a ? m : 1, ra > 2 ? m * k : 0};
    b = {args.transpose_b ? 1 : n, args.transpose_b ? k : 1, rb > 2 ? n * k : 0};
  }
  int64_t batch, m, n, k;
  Matrix a, b;
};

}  // namespace restage::cpu
