// Learning rates as pure functions of the step.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/config/config_reader.h"

namespace restage {

struct ScheduleConfig {
  enum class Kind {
    constant,
    milestones,
    cosine,
    linear,
    polynomial,
    exponential,
    restarts,
    one_cycle
  };
  double rate = 1e-4;  ///< before any decay
  Kind kind = Kind::constant;
  std::vector<int64_t> milestones;  ///< steps, increasing; kind milestones
  double factor = 0.1;              ///< what the rate is multiplied by at every milestone
  int64_t warmup = 0;               ///< steps of linear growth from rate / warmup to rate
  double final_fraction = 0.0;      ///< the last rate as a share of `rate`, where it falls
  double power = 1;                 ///< kind polynomial
  int64_t period = 1000;            ///< kind restarts: steps of the first period
  int64_t period_factor = 1;        ///< what every period is longer by than the one before
  double rise = 0.3;                ///< kind one_cycle: share of the steps in which the rate grows
  double initial_fraction = 0.04;   ///< the first rate as a share of `rate`
};

inline EnumNames<ScheduleConfig::Kind> config_names(ScheduleConfig::Kind) {
  using Kind = ScheduleConfig::Kind;
  return {{"constant", Kind::constant},     {"milestones", Kind::milestones},
          {"cosine", Kind::cosine},         {"linear", Kind::linear},
          {"polynomial", Kind::polynomial}, {"exponential", Kind::exponential},
          {"restarts", Kind::restarts},     {"one_cycle", Kind::one_cycle}};
}

/// Every milestone is larger than the one before it.
bool increasing(const std::vector<int64_t>& steps);

template <class V>
void visit(V& v, ScheduleConfig& c) {
  using Kind = ScheduleConfig::Kind;
  v("rate", c.rate, "learning rate before any decay", at_least(0));
  v("kind", c.kind, "how the rate changes");
  v("milestones", c.milestones, "steps at which the rate is multiplied by factor", positive());
  v("factor", c.factor, "applied at each milestone", positive());
  v("warmup", c.warmup, "steps of linear growth at the start", at_least(0));
  v("final_fraction", c.final_fraction, "last rate over rate, of kinds that fall by the step",
    between(0, 1));
  v("power", c.power, "kind polynomial: of the share of the way that is left",
    added("1", positive()));
  v("period", c.period, "kind restarts: steps to the first restart", added("1000", positive()));
  v("period_factor", c.period_factor, "kind restarts: each period over the one before",
    added("1", positive()));
  v("rise", c.rise, "kind one_cycle: share of the steps in which the rate grows",
    added("0.3", between(0, 1)));
  v("initial_fraction", c.initial_fraction, "kind one_cycle: first rate over rate",
    added("0.04", between(0, 1)));
  v.check("milestones", increasing(c.milestones), "must increase", "sort the steps, each once");
  v.check("milestones", c.kind == Kind::milestones || c.milestones.empty(),
          "is only for 'kind: milestones'", "set that kind or remove the list");
  v.check("final_fraction", c.kind != Kind::exponential || c.final_fraction > 0,
          "is 0, which no exponential decay reaches", "give a small share, such as 0.01");
  v.check("warmup", c.kind != Kind::one_cycle || c.warmup == 0,
          "is not for 'kind: one_cycle', which has a rise of its own",
          "set rise, a share of the steps, instead");
}

/// Rate of step `step` (from 0) of a training of `steps` steps.
///
///   constant     rate
///   milestones   PyTorch's MultiStepLR, rate * factor^(number of milestones <= step)
///   cosine       half a cosine from rate to rate * final_fraction
///   linear       a line between the same
///   polynomial   rate * (f + (1 - f) (1 - t)^power), f final_fraction, t the share of the way
///   exponential  rate * f^t
///   restarts     SGDR (Loshchilov and Hutter 2017), PyTorch's CosineAnnealingWarmRestarts: half a
///                cosine from rate towards rate * f over `period` steps, then again from rate, over
///                period_factor times as many steps
///   one_cycle    PyTorch's OneCycleLR: half a cosine from rate * initial_fraction up to rate in
///                the share `rise` of the steps, then half a cosine down to rate * f
///
/// The way goes from the end of the warm-up to the last step. In the warm-up the rate is multiplied
/// by (step + 1) / warmup; restarts count their periods from its end.
double learning_rate(const ScheduleConfig& config, int64_t step, int64_t steps);

}  // namespace restage
