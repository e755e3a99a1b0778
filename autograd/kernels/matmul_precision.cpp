#include "autograd/kernels/matmul_precision.h"

#include <atomic>

namespace restage {
namespace {

std::atomic<MatmulPrecision> current{MatmulPrecision::float32};

}  // namespace

MatmulPrecision matmul_precision() { return current.load(std::memory_order_relaxed); }

void set_matmul_precision(MatmulPrecision precision) {
  current.store(precision, std::memory_order_relaxed);
}

}  // namespace restage
