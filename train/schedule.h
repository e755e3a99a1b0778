// Learning rates as pure functions of the step.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/config/config_reader.h"

namespace restage {

struct ScheduleConfig {
  enum class Kind { constant, milestones, cosine };
  double rate = 1e-4;  ///< before any decay
  Kind kind = Kind::constant;
  std::vector<int64_t> milestones;  ///< steps, increasing; kind milestones
  double factor = 0.1;              ///< what the rate is multiplied by at every milestone
  int64_t warmup = 0;               ///< steps of linear growth from rate / warmup to rate
  double final_fraction = 0.0;      ///< kind cosine: the last rate as a share of `rate`
};

inline EnumNames<ScheduleConfig::Kind> config_names(ScheduleConfig::Kind) {
  using Kind = ScheduleConfig::Kind;
  return {{"constant", Kind::constant}, {"milestones", Kind::milestones}, {"cosine", Kind::cosine}};
}

/// Every milestone is larger than the one before it.
bool increasing(const std::vector<int64_t>& steps);

template <class V>
void visit(V& v, ScheduleConfig& c) {
  v("rate", c.rate, "learning rate before any decay", at_least(0));
  v("kind", c.kind, "how the rate changes");
  v("milestones", c.milestones, "steps at which the rate is multiplied by factor", positive());
  v("factor", c.factor, "applied at each milestone", positive());
  v("warmup", c.warmup, "steps of linear growth at the start", at_least(0));
  v("final_fraction", c.final_fraction, "cosine: last rate over first", between(0, 1));
  v.check("milestones", increasing(c.milestones), "must increase", "sort the steps, each once");
  v.check("milestones", c.kind == ScheduleConfig::Kind::milestones || c.milestones.empty(),
          "is only for 'kind: milestones'", "set that kind or remove the list");
}

/// Rate of step `step` (from 0) of a training of `steps` steps.
/// constant: rate. milestones: PyTorch's MultiStepLR, rate * factor^(number of milestones <= step).
/// cosine: from rate at the end of the warm-up to rate * final_fraction at the last step, half a
/// cosine between. In the warm-up all of them are multiplied by (step + 1) / warmup.
double learning_rate(const ScheduleConfig& config, int64_t step, int64_t steps);

}  // namespace restage
