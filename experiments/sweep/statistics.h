// Means and intervals of repeated trials: the rule behind every figure of `restage sweep table`.
//
// A sample is a group of trials (a repetition each: usually one setting with several seeds), every
// trial measured on the same sequences. With x[k, s] the value of trial k on sequence s:
//   mean       the average over trials of each trial's mean over its sequences
//   deviation  the sample deviation (n - 1) of these n means; none for n = 1
//   interval   95 % percentiles (2.5 and 97.5, linearly interpolated) of the means of 10,000
//              resamples. One resample draws n trials with replacement and, once for all of them,
//              as many names of sequences as there are, with replacement: a hard sequence is hard
//              for every seed, so its weight must not average out over the seeds. A trial that has
//              no value on any drawn sequence is left out of that resample. One trial: only
//              sequences are drawn. One sequence: only trials. One of each: no interval.
//   difference of two samples: the same of x[k, s] - y[k, s] over the pairs (trial, sequence) that
//              both have. What both share, a hard sequence or a lucky seed, cancels.
// Few trials cannot show how far seeds scatter: with three, and nothing but the seeds to make a
// difference, such an interval holds the truth in some 75 of 100 cases
// (docs/notes/experiments_log.md has the simulation). Each set of sequences is a sample of its own;
// sets are never mixed.
//
// All draws are functions of the seed and the two counts, so equal input gives equal bits.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace restage::tables {

inline constexpr int kResamples = 10'000;

/// One trial's values of one metric on one set. Not a number: absent.
struct Repetition {
  std::string key;  ///< what pairs it with a repetition of another sample, such as "seed 1"
  double mean = 0;  ///< as its result tells it
  std::map<std::string, double> sequences;  ///< by name; may be empty
};
using Sample = std::vector<Repetition>;

/// n = 0: nothing was measured and all else is absent.
struct Estimate {
  int n = 0;  ///< trials with a mean
  std::optional<double> mean, deviation, low, high;
};

/// The pairs that both samples have, as a sample of their differences, `a` - `b`. Repetitions pair
/// by key (the first of equal keys), sequences by name; a pair without a common sequence is the
/// difference of its means.
Sample paired_difference(const Sample& a, const Sample& b);

/// The largest gap between a repetition's mean and the average over its sequences, relative to the
/// larger of the two; 0 without sequences. Above rounding, the intervals are those of sequences
/// shifted to the mean.
double largest_contradiction(const Sample& sample);

/// Linearly interpolated quantile `q` in [0, 1] of sorted values (numpy's default). Not empty.
double quantile(std::span<const double> sorted, double q);

/// Draws once for every pair of counts and uses these draws for all samples of that size.
class Bootstrap {
 public:
  explicit Bootstrap(uint64_t seed, int resamples = kResamples)
      : seed_(seed), resamples_(resamples) {}
  Estimate estimate(const Sample& sample);

 private:
  /// How often each trial [resamples, n] and each sequence [resamples, s] was drawn.
  struct Draws {
    Eigen::MatrixXf trials, sequences;
  };
  const Draws& draws(Eigen::Index trials, Eigen::Index sequences);

  uint64_t seed_;
  int resamples_;
  std::map<std::pair<Eigen::Index, Eigen::Index>, Draws> draws_;
};

}  // namespace restage::tables
