#include "train/gradient_noise.h"

#include <limits>

#include "train/optim/parameters.h"

namespace restage {
namespace {

constexpr const char* kNoiseState = "loop.gradient_noise";

}  // namespace

void GradientNoise::add(double small, double big) {
  const double square = (big_ * big - small_ * small) / (big_ - small_);
  const double trace = (small - big) / (1 / small_ - 1 / big_);
  square_ = kPast * square_ + (1 - kPast) * square;
  trace_ = kPast * trace_ + (1 - kPast) * trace;
  weight_ = kPast * weight_ + (1 - kPast);
}

std::vector<std::pair<std::string, double>> GradientNoise::values() const {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  // Few steps may say that the square is below zero.
  return {{"noise_scale", square_ > 0 ? trace_ / square_ : nothing},
          {"noise_trace", weight_ > 0 ? trace_ / weight_ : nothing},
          {"gradient_square", weight_ > 0 ? square_ / weight_ : nothing}};
}

void GradientNoise::save(TensorFile* file) const {
  file->tensors[kNoiseState] = Tensor::from<double>({3}, {trace_, square_, weight_});
}

void GradientNoise::load(const TensorFile& file, const std::string& where) {
  const Tensor state = saved_state(file, kNoiseState, {3}, where);
  trace_ = state.item(0), square_ = state.item(1), weight_ = state.item(2);
}

}  // namespace restage
