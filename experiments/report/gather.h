// What a report shows, gathered from runs of `restage train` or from the folder of a sweep.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/report/page.h"

namespace restage::report {

struct GatherOptions {
  uint64_t seed = 0;  ///< of held-out sequences
  /// Folders with a sequence each (datasets/benchmark/sequence.h) to be played. None: of a run,
  /// those of its own held-out sequences that came out best, in the middle and worst.
  std::vector<std::string> sequences;
  std::string trial;  ///< whose answer to `sequences` is played; none: the sweep's best one
  bool play = true;
};

/// Runs that are finished are measured as `restage eval run=RUN` does, and the first of them is
/// played. InputError: no run, or data that are not there.
Report of_runs(const std::vector<std::string>& folders, const GatherOptions& how);
/// InputError: no sweep, no such trial.
Report of_sweep(const std::string& dir, const GatherOptions& how);
/// Does the folder hold a sweep rather than a run?
bool is_sweep(const std::string& folder);
/// What a report on this folder reads, so that it is not written over.
std::vector<std::string> inputs_of(const std::string& folder);

}  // namespace restage::report
