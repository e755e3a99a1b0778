#include "train/selection.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/kernels/update.h"
#include "train/optim/parameters.h"

namespace restage {
namespace {

const std::string kAverage = "loop.ema.";
constexpr const char *kBest = "loop.best", *kCounts = "loop.best_counts", *kMark = "loop.best_mark";

}  // namespace

WeightAverage::WeightAverage(Stage& stage, const SelectionConfig& config)
    : weights_(stage.weights()), decay_(config.ema) {
  for (const StateEntry& entry : weights_) {
    average_.push_back(entry.value->clone());
    averaged_.push_back(entry.parameter != nullptr && !stage.frozen(entry.parameter->id));
  }
  if (config.swa_from > 0)
    first_ = static_cast<int64_t>(config.swa_from * static_cast<double>(stage.steps()));
}

WeightAverage::WeightAverage(std::vector<StateEntry> parameters, double decay)
    : weights_(std::move(parameters)), averaged_(weights_.size(), true), decay_(decay) {
  for (const StateEntry& entry : weights_) average_.push_back(entry.value->clone());
  if (decay == 0) first_ = 0;
}

void WeightAverage::add(int64_t done) {
  const auto t = static_cast<double>(done), n = static_cast<double>(done - first_);
  mix(first_ < 0 ? std::min(decay_, (1 + t) / (10 + t)) : n > 1 ? (n - 1) / n : 0);
}

void WeightAverage::mix(double keep) {
  std::vector<MixArgs::Of> mixed;
  for (size_t i = 0; i < weights_.size(); ++i) {
    if (averaged_[i] && keep > 0)
      mixed.push_back({*weights_[i].value, average_[i]});
    else
      average_[i] = weights_[i].value->clone();
  }
  launch_all(MixArgs{mixed, keep, 1 - keep});
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

const std::pair<std::string, double>& figure_monitored(const NamedValues& figures,
                                                       const std::string& monitor) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const auto& figure) {
    return monitor.empty() || figure.first == monitor;
  });
  if (found == figures.end())
    throw InputError("", "the validation has no '" + monitor + "'", "name another in monitor");
  return *found;
}

bool BestSoFar::add(int64_t done, const NamedValues& figures) {
  const double value = figure_monitored(figures, monitor_).second;
  const bool good = std::isfinite(value), first = step_ < 0;
  if (good && (first || value < mark_ - min_delta_))
    mark_ = value, worse_ = 0;
  else
    ++worse_;
  if (!good || (!first && !(value < value_))) return false;
  value_ = value, step_ = done;
  return true;
}

std::string BestSoFar::text() const {
  if (step_ < 0) return "none good yet";
  return format("best %.5g at %lld", value_, static_cast<long long>(step_));
}

void BestSoFar::save(TensorFile* file) const {
  file->tensors[kBest] = Tensor::from<double>({1}, {value_});
  file->tensors[kCounts] = Tensor::from<int64_t>({2}, {step_, worse_});
  if (min_delta_ > 0) file->tensors[kMark] = Tensor::from<double>({1}, {mark_});
}

void BestSoFar::load(const TensorFile& file, const std::string& where) {
  value_ = saved_state(file, kBest, {1}, where).data<double>()[0];
  mark_ = min_delta_ > 0 ? saved_state(file, kMark, {1}, where).data<double>()[0] : value_;
  const Tensor counts = saved_state(file, kCounts, {2}, where);
  step_ = counts.data<int64_t>()[0], worse_ = counts.data<int64_t>()[1];
}

std::string monitored(const SelectionConfig& config, const std::string& stage) {
  for (const std::string& name : config.monitor)
    if (name.starts_with(stage + ".")) return name.substr(stage.size() + 1);
  return "";
}

}  // namespace restage
