// The folders under experiments/ that stand for a paper's evidence, and what was found in them:
//
//   NAME/sweep.yaml           the experiment; absent if nothing of it runs here
//   NAME/schedule.yaml        the same with the papers' own schedules, for the budget `paper`,
//                             where rows differ in them
//   NAME/paper.yaml           what the paper prints and claims (paper_file.h)
//   NAME/README.md            what is the same here and what is not
//   NAME/results/ID.json      result.json of trials that were run once, without weights
//   NAME/results/BUDGET.json  plan.json of the trials that a budget stands for
//   NAME/results/references/SUM.json
//                             the scores of a reference, such as "rest_pose". Many trials measured
//                             the same, so ID.json has SUM in their place: the first 12 hex digits
//                             of the SHA-256 of the file with the scores
//
// Committed results are as good as new ones: the id says that the question is the same, and no
// digit is left out.
#pragma once

#include <string>
#include <vector>

#include "experiments/reproduce/paper_file.h"
#include "experiments/sweep/results.h"

namespace restage::reproduce {

struct Evidence {
  std::string name;    ///< of the folder
  std::string folder;  ///< under experiments/
  std::string dir;     ///< the sweep's folder, where trials are run
  PaperFile asked;

  bool runs() const { return !asked.none_runs(); }
  std::string sweep_file(const Budget& budget) const { return folder + "/" + budget.sweep; }
};

/// Those of `paper` below `from`, by name; `table`: only that one. InputError with the known names
/// if there are none. `out`: below which the sweeps are run.
std::vector<Evidence> find_evidence(const std::string& from, const std::string& paper,
                                    const std::string& table, const std::string& out);

/// Puts committed results of trials that its plan asks for, and that are not done, where the sweep
/// looks for them, with the scores of their references. What is damaged is told and left out.
/// Returns how many.
int take_results(const Evidence& evidence);
/// Without planning: the sweep's folder from the committed plan of a budget, if it has none yet.
/// False: there is no such plan.
bool take_plan(const Evidence& evidence, const std::string& budget);
/// The other way round: results of trials that are done, and the plan, to be committed.
void keep_results(const Evidence& evidence, const std::string& budget);

/// What the sweep's folder holds; nothing was run if there is none.
tables::Results results_of(const Evidence& evidence);

}  // namespace restage::reproduce
