// What every stage says about its optimisation, and the optimiser that this describes: one rule
// for everything, or Muon for matrices and Adam for the rest (biases, norms, narrow layers).
#pragma once

#include <algorithm>
#include <limits>
#include <memory>

#include "train/optim/adam.h"
#include "train/optim/groups.h"
#include "train/optim/lion.h"
#include "train/optim/muon.h"
#include "train/optim/sgd.h"
#include "train/schedule.h"

namespace restage {

struct OptimiserConfig {
  enum class Kind { adam, adamw, muon, sgd, lion };
  int64_t steps = 1000, batch = 16;
  ScheduleConfig schedule;
  Kind kind = Kind::adam;
  AdamConfig adam;
  MuonConfig muon;
  SgdConfig sgd = {};
  LionConfig lion = {};
  double clip = 0, clip_value = 0;
  std::vector<ParameterGroup> groups = {};

  /// Whether a group has a decay that this kind cannot give it.
  bool decays_muon() const {
    return kind == Kind::muon && std::any_of(groups.begin(), groups.end(), [](const auto& group) {
             return group.decay.has_value();
           });
  }
};

inline EnumNames<OptimiserConfig::Kind> config_names(OptimiserConfig::Kind) {
  using Kind = OptimiserConfig::Kind;
  return {{"adam", Kind::adam},
          {"adamw", Kind::adamw},
          {"muon", Kind::muon},
          {"sgd", Kind::sgd},
          {"lion", Kind::lion}};
}

template <class V>
void visit(V& v, OptimiserConfig& c) {
  v("steps", c.steps, "optimiser steps; 0: the networks stay as they begin", between(0, 1e9));
  v("batch", c.batch, "examples per step", between(1, 1e5));
  v("schedule", c.schedule, "learning rate");
  v("kind", c.kind, "what moves all parameters; muon: Muon for matrices and Adam for the rest");
  v("adam", c.adam, "kinds adam, adamw, and what muon leaves");
  v("muon", c.muon, "kind muon: its matrices");
  v("sgd", c.sgd, "kind sgd", added("{}"));
  v("lion", c.lion, "kind lion", added("{}"));
  v("clip", c.clip, "largest global norm of the gradient; 0: no clipping", at_least(0));
  v("clip_value", c.clip_value,
    "largest number of the gradient, before clip by its norm; 0: no clipping",
    added("0", at_least(0)));
  v("groups", c.groups, "parameters with a rate, a decay or a beginning of their own", added("[]"));
  v.check("groups", !c.decays_muon(), "sets a decay, which 'kind: muon' does not have",
          "leave decay out, or choose kind adamw");
}

/// How many numbers Muon moves, how many Adam or the rule of another kind, and how many never
/// move.
struct OptimisedNumbers {
  int64_t muon = 0, adam = 0, frozen = 0;
};

class Optimiser {
 public:
  /// A step after all steps until which groups are frozen.
  static constexpr int64_t kLastStep = std::numeric_limits<int64_t>::max();

  /// Optimises the parameters of `modules`; the state of each is saved under its prefix. InputError
  /// naming `where`: a group matches nothing, or the groups freeze everything.
  Optimiser(const std::vector<std::pair<std::string, Module*>>& modules,
            const OptimiserConfig& config, const std::string& where = "optimiser.groups");
  /// One update; a parameter without gradient stays. The norm that is clipped is taken over the
  /// parameters of this optimiser that the step moves, whatever else `gradients` holds; gradients
  /// are scaled down as torch's clip_grad_norm_ does, after torch's clip_grad_value_.
  /// `step`: the number of the step, for groups that are frozen until one.
  void step(const Gradients& gradients, double rate, int64_t step = kLastStep);
  /// Identities of the parameters of this optimiser, ascending.
  const std::vector<uint64_t>& parameters() const { return ids_; }
  /// Whether a parameter is of this optimiser and never moves.
  bool frozen(uint64_t id) const;
  OptimisedNumbers numbers() const { return numbers_; }
  void save(const std::string& prefix, TensorFile& file) const;
  /// InputError if the state does not fit.
  void load(const std::string& prefix, const TensorFile& file, const std::string& where);

 private:
  /// What moves some of the parameters in the same way.
  struct Part {
    ParameterGroup group;
    std::vector<std::unique_ptr<UpdateRule>> rules;
  };
  void add(const std::vector<NamedParameter>& parameters, const ParameterGroup& group,
           const OptimiserConfig& config);
  /// Identities of what a step moves, ascending.
  std::vector<uint64_t> moving(int64_t step) const;

  std::vector<uint64_t> ids_, frozen_;
  std::vector<std::pair<uint64_t, int64_t>> later_;  ///< what begins to move with a later step
  std::vector<Part> parts_;
  double clip_, clip_value_;
  OptimisedNumbers numbers_;
};

}  // namespace restage
