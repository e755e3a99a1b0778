// The figure that says which trial is better, of a search, a live view or a picture. It has two
// forms: STAGE.FIGURE, of the validations while a stage is trained (motion.pa_mpjpe), and
// SET.METRIC, of what a trial's result was measured on (clouds.pa_mpjpe). Less is better.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/early_stop.h"
#include "experiments/sweep/plan.h"
#include "experiments/sweep/sweep_dir.h"

namespace restage::sweep {

/// Whether it is a figure of a stage's validations.
bool is_of_training(const std::string& metric);
/// InputError at `place`: no trial has such a figure.
void check_metric(const std::string& metric, const ConfigPlace& place, const SweepPlan& plan,
                  const Evaluate& evaluate);
/// What the sweep's own rules name: its search, else its early stop; else the first figure of the
/// last stage that trials make. "": none.
std::string main_metric(const SweepDir& dir);
/// The same of `wanted`, which a user gave. InputError: there is no such figure.
std::string main_metric(const SweepDir& dir, const std::string& wanted);

/// The folder of artifacts, seen from here.
std::string store_of(const SweepDir& dir);
/// The validations of a trial so far; empty if the metric is of results, or nothing was validated.
/// After the store was cleaned, they are those in the result.
Curve curve_of(const SweepDir& dir, const TrialEntry& trial,
               const std::optional<tables::TrialResult>& result, const std::string& metric);
/// What a trial came to: what somebody told, else the last validation, or the result's mean over
/// sequences. Infinite: it failed, or has no such figure. Nothing: it is not over.
std::optional<double> value_of(const SweepDir& dir, const TrialEntry& trial,
                               const std::optional<tables::TrialResult>& result,
                               const std::string& metric);

}  // namespace restage::sweep
