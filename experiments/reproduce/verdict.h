// Whether a claim of a paper holds here. The rule:
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
//
//   A claim holds if all of its comparisons do (of `most`: three quarters), does not hold if so
//   many are reversed that this cannot be (one; of `most`: more than a quarter), and cannot be told
//   otherwise. One comparison that is not run leaves the claim not run. Some of several comparisons
//   are on one side by chance, so k of m count as clear at the level (m - k + 1) p, where p is the
//   k-th smallest of their levels (Benjamini and Heller 2008, "partial conjunction").
//
//   Claims of one page are judged together: what is clear by itself must stay clear by Holm's
//   procedure over all claims of the page that were run, at 5 % for the page.
//
//   A row is trained far enough if the last quarter of its steps lowers the judged figure by less
//   than 2 % (converged.h). A claim about a row that is not, or whose curve was not kept, is "not
//   trained far enough", whatever the intervals say.
//
// Amended after runs: `no_better_by` came when "did not lead to any noticeable improvement"
// (marsot2023, a loss on bone lengths) had been judged by `within`, which says something else. The
// last three paragraphs, and Student's intervals in the place of a bootstrap, came when three seeds
// were counted to hold the truth in 75 of 100 cases, and networks at 1/100 of their schedule had
// been judged.
//
// Only orders are judged. Figures of other data and other budgets are not the paper's, and are not
// expected to be.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "experiments/reproduce/paper_file.h"
#include "experiments/sweep/results.h"
#include "experiments/sweep/statistics.h"

namespace restage::reproduce {

enum class Verdict { holds, does_not_hold, cannot_be_told, not_trained, not_run };
inline constexpr const char* kVerdicts[] = {"holds", "does not hold", "cannot be told",
                                            "not trained far enough", "not run"};
inline constexpr int kFewestSeeds = 3;

/// A verdict with the budget that it is of: "holds at lite".
std::string verdict_text(Verdict verdict, const std::string& budget);

/// One comparison of a claim.
struct Finding {
  std::string set, metric;
  tables::Estimate difference = {};  ///< better - than
  /// The smallest levels at which the interval lies on the claim's side, and on the other; 1:
  /// never.
  double p_holds = 1, p_fails = 1;
  Verdict verdict = Verdict::not_run;
};

struct Judgement {
  Verdict so_far = Verdict::not_run;  ///< by the intervals alone
  std::vector<Finding> findings = {};
  double p = 1;                             ///< level at which the claim is clear, either way
  std::vector<std::string> too_short = {};  ///< why rows are not trained far enough, a line each

  Verdict verdict() const {
    return too_short.empty() || so_far == Verdict::not_run ? so_far : Verdict::not_trained;
  }
};

/// Of one comparison: `difference` is that of the claim's two rows.
Finding finding_of(const tables::Estimate& difference, const Claim& claim);
/// Of all comparisons of a claim, by itself.
Judgement judgement_of(std::vector<Finding> findings, bool most);
/// Holm's procedure over the claims of a page: what is not clear beside the others cannot be told.
void judge_together(const std::vector<Judgement*>& claims);

/// The set of the results that stands for one of the paper's.
const std::string& measured_set(const Budget& budget, const PaperTable& table);

/// A claim by itself.
Judgement judge(const PaperFile& file, const Budget& budget, const Claim& claim,
                const tables::Results& results);

/// The same rule on the paper's own figures, which have no intervals but were rounded: comparisons
/// of equal figures say nothing. cannot_be_told: all of them are equal; not_run: the paper prints
/// none.
Verdict printed_verdict(const PaperFile& file, const Claim& claim);

/// A sentence with the verdict of each of its readings. Pairs of rows of one reading must all hold.
struct Sentence {
  std::string says;
  std::map<std::string, Verdict> readings = {};
};
std::vector<Sentence> sentences_of(const std::vector<Claim>& claims,
                                   const std::vector<Verdict>& verdicts);
/// That of its readings if they agree; else it cannot be told.
Verdict sentence_verdict(const Sentence& sentence);
/// Of the paper's own figures: a sentence holds if one of its readings does.
Verdict best_reading(const Sentence& sentence);

}  // namespace restage::reproduce
