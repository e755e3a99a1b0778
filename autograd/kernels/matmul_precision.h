// How precisely float32 matrix products multiply. A switch for the whole process, like PyTorch's
// set_float32_matmul_precision; float32 unless somebody asks for less. An op reads the switch when
// it is made and keeps what it reads, so its backward pass multiplies as its forward pass did;
// kernels are told.
//
// tf32: NVIDIA's, operands with 11 bits of significand. The CPU has no such products: it computes
// them in float32, and configurations refuse tf32 there. Everything that is stored - weights,
// gradients, the optimiser's state, activations - stays float32. MatmulArgs says which products
// take part; those of float64 never do.
#pragma once

namespace restage {

/// The numbers are part of ids (train/training/identity.h), so they stay.
enum class MatmulPrecision { float32 = 0, tf32 = 2 };

/// The precision in use: ops that are made now compute with it.
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

}  // namespace restage
