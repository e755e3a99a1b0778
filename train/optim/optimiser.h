// What every stage says about its optimisation, and the optimiser that this describes: Adam for
// everything, or Muon for matrices and Adam for the rest (biases, norms, narrow layers).
#pragma once

#include "train/optim/adam.h"
#include "train/optim/muon.h"
#include "train/schedule.h"

namespace restage {

struct OptimiserConfig {
  enum class Kind { adam, muon };
  int64_t steps = 1000, batch = 16;
  ScheduleConfig schedule;
  Kind kind = Kind::adam;
  AdamConfig adam;
  MuonConfig muon;
  double clip = 0;
};

inline EnumNames<OptimiserConfig::Kind> config_names(OptimiserConfig::Kind) {
  return {{"adam", OptimiserConfig::Kind::adam}, {"muon", OptimiserConfig::Kind::muon}};
}

template <class V>
void visit(V& v, OptimiserConfig& c) {
  v("steps", c.steps, "optimiser steps; 0: the networks stay as they begin", between(0, 1e9));
  v("batch", c.batch, "examples per step", between(1, 1e5));
  v("schedule", c.schedule, "learning rate");
  v("kind", c.kind, "Adam for all parameters, or Muon for matrices and Adam for the rest");
  v("adam", c.adam, "Adam");
  v("muon", c.muon, "kind muon: its matrices");
  v("clip", c.clip, "largest global norm of the gradient; 0: no clipping", at_least(0));
}

/// How many numbers each of the two moves.
struct OptimisedNumbers {
  int64_t muon = 0, adam = 0;
};

class Optimiser {
 public:
  /// Optimises the parameters of `modules`; the state of each is saved under its prefix.
  Optimiser(const std::vector<std::pair<std::string, Module*>>& modules,
            const OptimiserConfig& config);
  /// One update; a parameter without gradient stays. The norm that is clipped is taken over the
  /// parameters of this optimiser, whatever else `gradients` holds; gradients are scaled down as
  /// torch's clip_grad_norm_ does.
  void step(const Gradients& gradients, double rate);
  /// Identities of the parameters of this optimiser, ascending.
  const std::vector<uint64_t>& parameters() const { return ids_; }
  OptimisedNumbers numbers() const { return numbers_; }
  void save(const std::string& prefix, TensorFile& file) const;
  /// InputError if the state does not fit.
  void load(const std::string& prefix, const TensorFile& file, const std::string& where);

 private:
  std::vector<uint64_t> ids_;
  Muon muon_;
  Adam adam_;
  double clip_;
  OptimisedNumbers numbers_;
};

}  // namespace restage
