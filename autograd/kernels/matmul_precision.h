// How precisely float32 matrix products multiply. A switch for the whole process, like PyTorch's
// set_float32_matmul_precision; float32 unless somebody asks for less. An op reads it when it is
// made and keeps it, so its backward pass multiplies as its forward pass did; kernels are told.
//
// bfloat16: the operands of a product are rounded to bfloat16 (8 bits of significand, float32's
// range; to nearest, ties to even; NaN stays NaN) while they are packed. Products of two such
// numbers are exact in float32 and are summed in float32, in the order that kernels/matmul.h says.
// tf32: NVIDIA's, operands with 11 bits of significand; the CPU has no such products, computes them
// in float32, and configurations refuse it there.
// Everything that is stored - weights, gradients, the optimiser's state, activations - stays
// float32. Which products take part is for MatmulArgs to say; float64 never does.
#pragma once

namespace restage {

enum class MatmulPrecision { float32, bfloat16, tf32 };

/// The one in use: what ops that are made now compute with.
MatmulPrecision matmul_precision();
void set_matmul_precision(MatmulPrecision precision);

/// Sets the precision for as long as the object lives.
class MatmulPrecisionScope {
 public:
  explicit MatmulPrecisionScope(MatmulPrecision precision) : before_(matmul_precision()) {
    set_matmul_precision(precision);
  }
  ~MatmulPrecisionScope() { set_matmul_precision(before_); }
  MatmulPrecisionScope(const MatmulPrecisionScope&) = delete;
  MatmulPrecisionScope& operator=(const MatmulPrecisionScope&) = delete;

 private:
  MatmulPrecision before_;
};

/// Whether this processor (and its operating system) has a matrix unit for bfloat16: Intel's AMX.
/// Without it vector instructions compute the same bits, slower than float32 products.
bool has_matrix_unit();

/// Whether it is used: by default if it is there. For tests and measurements: not while kernels
/// run. Asking for one that is not there is an Error.
bool matrix_unit();
void use_matrix_unit(bool use);

}  // namespace restage
