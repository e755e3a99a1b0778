#include "train/selection.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/kernels/update.h"
#include "train/optim/parameters.h"

namespace restage {
namespace {

const std::string kAverage = "loop.ema.";
constexpr const char *kBest = "loop.best", *kCounts = "loop.best_counts";

}  // namespace

WeightAverage::WeightAverage(Stage& stage, double decay)
    : weights_(stage.weights()), decay_(decay) {
  for (const StateEntry& entry : weights_) average_.push_back(entry.value->clone());
}

void WeightAverage::add(int64_t done) {
  const auto t = static_cast<double>(done);
  const double keep = std::min(decay_, (1 + t) / (10 + t));
  for (size_t i = 0; i < weights_.size(); ++i) {
    if (weights_[i].parameter != nullptr)
      launch(MixArgs{*weights_[i].value, average_[i], keep, 1 - keep});
    else
      average_[i] = weights_[i].value->clone();
  }
}

void WeightAverage::exchange() {
  for (size_t i = 0; i < weights_.size(); ++i) std::swap(*weights_[i].value, average_[i]);
}

void WeightAverage::save(TensorFile* file) const {
  for (size_t i = 0; i < weights_.size(); ++i)
    file->tensors[kAverage + weights_[i].name] = average_[i].cpu();
}

void WeightAverage::load(const TensorFile& file, const std::string& where) {
  for (size_t i = 0; i < weights_.size(); ++i)
    average_[i] = saved_state(file, kAverage + weights_[i].name, average_[i].shape(), where,
                              average_[i].device());
}

bool BestSoFar::add(int64_t done, const NamedValues& figures) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const auto& figure) {
    return monitor_.empty() || figure.first == monitor_;
  });
  if (found == figures.end())
    throw InputError("", "the validation has no '" + monitor_ + "'", "name another in monitor");
  const double value = found->second;
  const bool better = std::isfinite(value) && (step_ < 0 || value < value_ - min_delta_);
  if (!better) {
    ++worse_;
    return false;
  }
  value_ = value, step_ = done, worse_ = 0;
  return true;
}

std::string BestSoFar::text() const {
  if (step_ < 0) return "none good yet";
  return format("best %.5g at %lld", value_, static_cast<long long>(step_));
}

void BestSoFar::save(TensorFile* file) const {
  file->tensors[kBest] = Tensor::from<double>({1}, {value_});
  file->tensors[kCounts] = Tensor::from<int64_t>({2}, {step_, worse_});
}

void BestSoFar::load(const TensorFile& file, const std::string& where) {
  value_ = saved_state(file, kBest, {1}, where).data<double>()[0];
  const Tensor counts = saved_state(file, kCounts, {2}, where);
  step_ = counts.data<int64_t>()[0], worse_ = counts.data<int64_t>()[1];
}

std::string monitored(const SelectionConfig& config, const std::string& stage) {
  for (const std::string& name : config.monitor)
    if (name.starts_with(stage + ".")) return name.substr(stage.size() + 1);
  return "";
}

}  // namespace restage
