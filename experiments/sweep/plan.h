// From a sweep file to its trials.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "experiments/sweep/plan_file.h"
#include "experiments/sweep/sweep_file.h"
#include "experiments/sweep/trial_work.h"

namespace restage::sweep {

/// Time and memory of what is to be made, from a few measured steps.
struct Forecast {
  double seconds = 0;        ///< one after the other, on this machine, evaluation apart
  int64_t memory_bytes = 0;  ///< of tensors, in the largest stage
  double longest = 0;        ///< seconds of the trial that trains longest, as if it shared nothing
};

struct SweepPlan {
  std::vector<PlannedTrial> trials;
  int there = 0, to_make = 0;  ///< different artifacts, in the store or not
  int shared = 0;              ///< those of them that several trials use
};

/// Every case x grid x zip x point of the search x seed that is not excluded, in this order, the
/// last fastest. InputError at file and line: a value that the configuration refuses, a key that no
/// stage reads, an `exclude` that matches nothing, two combinations that give the same trial.
SweepPlan plan_sweep(const SweepFile& file);

/// The configurations alone, each with the name of its case; seeds apart, and nothing of them is
/// checked.
std::vector<std::pair<std::string, ConfigNode>> configurations(const SweepFile& file);

/// Trains a few steps of every stage that is to be made; trials that differ by their seed alone are
/// measured once.
Forecast measure(const SweepPlan& plan);

/// As plan.json knows it.
TrialEntry entry_of(const PlannedTrial& trial);
/// "a=1, b=[2, 3]": what distinguishes a trial, for people.
std::string describe(const PlannedTrial& trial);

}  // namespace restage::sweep
