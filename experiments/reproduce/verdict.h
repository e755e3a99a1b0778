// Whether a claim of a paper holds here. The rule, written down before any run:
//
//   A comparison is the paired difference (experiments/sweep/statistics.h) of two rows on one set
//   and metric, over seeds and sequences. All metrics here are errors, so `better` should be less.
//     holds            the 95 % interval of better - than lies below 0
//     does not hold    it lies above 0: the order is the other way round
//     cannot be told   it contains 0, or there are fewer than three pairs of seeds
//   Where the claim is that two rows are alike (`within: m`), either way: holds if the interval
//   lies between -m and m, does not hold if it lies outside, cannot be told otherwise. Where the
//   claim is that there is no noticeable improvement (`no_better_by: m`), only a gain speaks
//   against it: holds if the interval lies above -m (also if all of it is above 0: worse is no
//   improvement), does not hold if it lies below -m, cannot be told otherwise.
//     not run          one of the rows is not there
//   A claim holds if all of its comparisons do (of `most`: three quarters), does not hold if so
//   many are reversed that this cannot be (one; of `most`: more than a quarter), and cannot be told
//   otherwise. One comparison that is not run leaves the claim not run.
//
// Amended once after a run: `no_better_by` came when "did not lead to any noticeable improvement"
// (marsot2023, a loss on bone lengths) had been judged by `within`, which says something else.
//
// Only orders are judged. Figures of other data and other budgets are not the paper's, and are not
// expected to be.
#pragma once

#include <string>
#include <vector>

#include "experiments/reproduce/paper_file.h"
#include "experiments/sweep/results.h"
#include "experiments/sweep/statistics.h"

namespace restage::reproduce {

enum class Verdict { holds, does_not_hold, cannot_be_told, not_run };
inline constexpr const char* kVerdicts[] = {"holds", "does not hold", "cannot be told", "not run"};
inline constexpr int kFewestSeeds = 3;

/// One comparison of a claim.
struct Finding {
  std::string set, metric;
  tables::Estimate difference;  ///< better - than
  Verdict verdict = Verdict::not_run;
};

struct Judgement {
  Verdict verdict = Verdict::not_run;
  std::vector<Finding> findings;
};

/// Of one comparison: `difference` is that of the claim's two rows.
Verdict verdict_of(const tables::Estimate& difference, const Claim& claim);
Verdict verdict_of(const std::vector<Finding>& findings, bool most);

/// The set of the results that stands for one of the paper's.
const std::string& measured_set(const Budget& budget, const PaperTable& table);

/// `seed`: of the resampling.
Judgement judge(const PaperFile& file, const Budget& budget, const Claim& claim,
                const tables::Results& results, uint64_t seed);

}  // namespace restage::reproduce
