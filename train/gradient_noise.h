// The gradient noise scale (McCandlish et al. 2018, "An empirical model of large-batch training",
// appendix A.1): from how many examples on a larger batch helps less than in proportion. It is
// estimated from the gradients of micro-batches, whose squared norms are larger than that of their
// mean by their noise.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "nn/weights/safetensors.h"

namespace restage {

class GradientNoise {
 public:
  /// Share of the past in the two averages whose ratio the scale is.
  static constexpr double kPast = 0.99;
  /// A step of `batch` examples in `parts` micro-batches, two or more.
  GradientNoise(int64_t batch, int64_t parts)
      : small_(static_cast<double>(batch) / static_cast<double>(parts)),
        big_(static_cast<double>(batch)) {}
  /// `small`: mean of the squared norms of micro-batches; `big`: squared norm of the whole step.
  void add(double small, double big);
  /// noise_scale, in examples (NaN: not known yet); noise_trace, the trace of the covariance of one
  /// example's gradient; and gradient_square, the squared norm of the true gradient. Averages over
  /// about the last hundred steps.
  std::vector<std::pair<std::string, double>> values() const;
  void save(TensorFile* file) const;
  /// InputError naming `where` if it is missing.
  void load(const TensorFile& file, const std::string& where);

 private:
  double small_, big_;                          // examples
  double trace_ = 0, square_ = 0, weight_ = 0;  // running sums, and what they are of
};

}  // namespace restage
