// One case of the oracle: a file of inputs and parameters, answered by the project's own tape, ops
// and models.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/safetensors.h"

namespace restage::oracle {

/// out.*, idx.*, g.* and g.in.* of a case whose metadata name it and its dtype, computed on a
/// device; sizes come from the metadata and the shapes. InputError for an unknown case or one that
/// lacks something.
TensorFile answer(const TensorFile& question, const std::string& where, Device device = {});

/// One tensor that differs by more than is allowed, or is missing.
struct Difference {
  std::string name;
  double error;  ///< relative, infinite if missing or of another size
};
/// The measure of the oracle's compare.py: |a - b| <= tol max(max|b|, 1e-3 s), s the largest
/// magnitude among all out.* (or g.*); tensors of f32 cases below 1e-5 s count as zero.
std::vector<Difference> differences(const TensorFile& question, const TensorFile& answer,
                                    double tolerance);

}  // namespace restage::oracle
