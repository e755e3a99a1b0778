// The open benchmark's test sets (docs/benchmark.md) as something that weights can be judged on.
#pragma once

#include <functional>
#include <optional>
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

/// One sequence of a set, and what an answer to it holds.
struct BenchmarkSequence {
  std::string name;  ///< "walking-male-female"; of a set that is made: motion, source, target
  int64_t frames = 0, vertices = 0;
};
/// The sequences of a set, in order; quick. InputError as evaluate_benchmark_set().
std::vector<BenchmarkSequence> benchmark_sequences(const std::string& folder,
                                                   const std::string& set);

/// Writes the files of each sequence of a set that is made (test, seen) to OUT/SET/NAME, as
/// write_sequence() does; without `truth` no truth.h5. Returns their names. InputError: the set
/// lies in files already.
std::vector<std::string> write_benchmark_sequences(const std::string& folder,
                                                   const std::string& set, const std::string& out,
                                                   bool truth);

/// What a system answers to the sequence `name`, whose files are in `folder`
/// (datasets/benchmark/sequence.h), in the world; nothing if it refuses the sequence.
using BenchmarkAnswer = std::function<std::optional<PredictionFile>(const std::string& folder,
                                                                    const std::string& name)>;
/// Compares answers that are there already with the true ones. A sequence without an answer has no
/// values. InputError of an answer that does not fit its sequence.
SystemScores evaluate_benchmark_answers(const BenchmarkAnswer& answer, const std::string& folder,
                                        const std::string& set,
                                        std::span<const metrics::Metric> metrics,
                                        std::vector<std::string>* names);

/// Retargets every sequence of a set of the benchmark in `folder`, as `restage retarget` would, and
/// compares with the true answer. Scans first go through the doctor, as a user's would; a sequence
/// that cannot be retargeted gives a warning and has no values. `names`: of the sequences, in
/// order. InputError if the folder is no such benchmark, or the weights lack a model.
SystemScores evaluate_benchmark_set(const Bundle& weights, const std::string& folder,
                                    const std::string& set, const BenchmarkOptions& how,
                                    std::vector<std::string>* names);

}  // namespace restage
