// One trial of a sweep's folder, start to finish: what `restage trial DIR ID` does and every engine
// calls. Idempotent, and safe against being killed at any moment.
#pragma once

#include <string>

#include "experiments/sweep/sweep_dir.h"

namespace restage::sweep {

/// How a trial ended; `before`: there was nothing left to do.
enum class TrialEnd { done, stopped_early, before };

/// Does nothing if the trial is over. Else takes its lease, trains what is missing, evaluates and
/// writes result.json. WorkError: somebody else works on it, or the trial failed (its result says
/// so too). InputError: no such trial, or the data is not what it was planned with. Interrupted: a
/// signal or `restage sweep stop` came, and a checkpoint was written.
TrialEnd perform_trial(const std::string& dir, const std::string& id, bool quiet);

/// Makes the trial's artifacts up to that stage, to their last steps, and no result: for engines
/// that run stages which several trials share as jobs of their own.
void perform_stage(const std::string& dir, const std::string& id, const std::string& stage,
                   bool quiet);

}  // namespace restage::sweep
