// The open benchmark's test sets (docs/benchmark.md) as something that weights can be judged on.
#pragma once

#include <string>
#include <vector>

#include "experiments/evaluation/evaluation.h"

namespace restage {

/// InputError with the known names if there is no such set: test, seen, naked, clothed, scans.
void check_benchmark_set(const std::string& set);

struct BenchmarkOptions {
  std::string system = "chain";
  int64_t every = 1;  ///< frame of a sequence; above 1 there are no references
  uint64_t seed = 0;
  double anchor = RetargetOptions{}.anchor;
  /// See EvaluationConfig.
  bool steady_bones = false, keep_limbs = false, any_size = false, any_way_up = false;
  bool force = false;  ///< 'restage retarget --force'
  std::span<const metrics::Metric> metrics = metrics::table();
};

/// Retargets the sequence in a folder (datasets/benchmark/sequence.h) as `restage retarget` would.
/// Scans that are in a frame of their own first go through the doctor, as a user's would, and the
/// result is put back into the world. Without joints if the system has no rig.
Prediction retarget_sequence(const Bundle& weights, const std::string& folder,
                             const BenchmarkOptions& how = {});

/// Retargets every sequence of a set of the benchmark in `folder`, as `restage retarget` would, and
/// compares with the true answer. Scans first go through the doctor, as a user's would; a sequence
/// that cannot be retargeted gives a warning and has no values. `names`: of the sequences, in
/// order. InputError if the folder is no such benchmark, or the weights lack a model.
SystemScores evaluate_benchmark_set(const Bundle& weights, const std::string& folder,
                                    const std::string& set, const BenchmarkOptions& how,
                                    std::vector<std::string>* names);

}  // namespace restage
