// Means and intervals of repeated trials: the rule behind every figure of `restage sweep table`.
//
// A sample is a group of trials (a repetition each: usually one setting with several seeds), every
// trial measured on the same sequences. With x[k, s] the value of trial k on sequence s:
//   mean       the average over trials of each trial's mean over its sequences
//   deviation  the sample deviation (n - 1) of these n means; none for n = 1
//   interval   95 %: the mean's variance has three parts, those of the trials, of the sequences and
//              of what is left (a two-way table of random effects), each with its own degrees of
//              freedom. The interval is mean -+ sqrt(sum of t(freedom)^2 x part), t being Student's
//              quantile. A hard sequence is hard for every seed, so its weight does not average out
//              over the seeds. One trial: sequences alone make the interval. One sequence: trials
//              alone. One of each: no interval. Sequences that a trial lacks make no part of it,
//              but for the trials' own means.
//   difference of two samples: the same of x[k, s] - y[k, s] over the pairs (trial, sequence) that
//              both have. What both share, a hard sequence or a lucky seed, cancels.
// Such an interval holds the truth in 93 to 98 of 100 cases, for 3, 5 and 10 trials and any share
// of the three parts but one: where neither trial nor sequence makes a difference, in up to 99
// (tests/experiments/table_statistics_test.cpp counts). Each set of sequences is a sample of its
// own; sets are never mixed.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace restage::tables {

/// One trial's values of one metric on one set. Not a number: absent.
struct Repetition {
  std::string key;  ///< what pairs it with a repetition of another sample, such as "seed 1"
  double mean = 0;  ///< as its result tells it
  std::map<std::string, double> sequences;  ///< by name; may be empty
};
using Sample = std::vector<Repetition>;

/// A part of the variance of a mean.
struct Part {
  double variance = 0;
  int freedom = 0;
};

/// n = 0: nothing was measured and all else is absent.
struct Estimate {
  int n = 0;  ///< trials with a mean
  std::optional<double> mean, deviation, low, high;
  std::vector<Part> parts = {};  ///< empty: no interval

  /// Half of the interval that holds the truth but for `alpha`.
  double half_width(double alpha) const;
  /// The smallest `alpha` for which `border` lies outside of the interval; 1 without an interval.
  double p_beyond(double border) const;
};

/// Student's t: P(|T| < t), and the t for which it is `share`.
double student(double t, int freedom);
double student_quantile(double share, int freedom);

/// The pairs that both samples have, as a sample of their differences, `a` - `b`. Repetitions pair
/// by key (the first of equal keys), sequences by name; a pair without a common sequence is the
/// difference of its means.
Sample paired_difference(const Sample& a, const Sample& b);

/// The largest gap between a repetition's mean and the average over its sequences, relative to the
/// larger of the two; 0 without sequences. Above rounding, the intervals are those of sequences
/// shifted to the mean.
double largest_contradiction(const Sample& sample);

Estimate estimate(const Sample& sample);

}  // namespace restage::tables
