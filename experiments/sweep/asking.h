// A search that asks: each trial follows from what the ones before it came to. The state is the
// sweep's folder alone: plan.json holds what was asked for, in this order, and results say what
// came of it. So several processes and machines may ask, one at a time, and anybody may tell
// results.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/sweep_dir.h"

namespace restage::sweep {

/// The points that the folder's plan asked for before; none if there is no folder yet. InputError:
/// the plan is of other keys or values.
std::vector<search::Point> asked_in(const std::string& dir, const search::Space& space);

struct Question {
  TrialEntry trial;
  int number = 0;  ///< from 1
};

/// Adds a trial to the folder. `words`: `key=value` fixes a key of the space. `up_to`: not if so
/// many were asked for (0: no limit). Nothing: so many were, or no point is left. Changes the
/// working directory to the one that the sweep was planned from.
std::optional<Question> ask(const std::string& dir, const std::vector<std::string>& words,
                            int up_to);

/// Writes down what somebody else found: `value`, where less is better, or that the trial failed.
/// A trial that is done keeps what it measured. WorkError: the trial is being run.
void tell(const std::string& dir, const std::string& id, std::optional<double> value,
          const std::string& error);

}  // namespace restage::sweep
