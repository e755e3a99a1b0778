// The folder of a sweep (experiments.md, "Files of a sweep"):
//
//   sweep.yaml             the sweep file, resolved; reading it again gives the same trials
//   plan.json              the trials that it stands for, and where relative paths begin
//   lease.N                who plans just now
//   stop                   changes when the trials that run now are asked to end
//   trials/ID/config.yaml  resolved configuration
//   trials/ID/result.json  when the trial is over
//   trials/ID/lease.N      who works on it (train/lease.h)
//   trials/ID/log.txt
//
// Only the trials in plan.json count; others are of an earlier file, and stay.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/plan.h"
#include "experiments/sweep/results.h"
#include "train/lease.h"

namespace restage::sweep {

struct SweepDir : PlanFile {
  std::string path;  ///< as given

  std::string folder(const std::string& id) const { return path + "/trials/" + id; }
  std::string lease(const std::string& id) const { return folder(id) + "/lease"; }
  std::string result(const std::string& id) const { return folder(id) + "/result.json"; }
  std::string log(const std::string& id) const { return folder(id) + "/log.txt"; }
  /// InputError with the nearest id if there is none.
  const TrialEntry& trial(const std::string& id) const;
};

/// Writes or renews the folder, one process at a time; what is there already is not touched.
/// Returns how many trials of earlier plans stay in it unused.
/// InputError: `dir` is a folder of something else.
int write_sweep_dir(const std::string& dir, const SweepFile& file, const SweepPlan& plan);
/// Adds a trial to the folder's plan. The caller holds lease_plan().
void add_trial(const SweepDir& dir, const PlannedTrial& trial);
/// The right to change the plan; waits for another process that has it.
Lease lease_plan(const std::string& dir);
/// InputError: no sweep's folder.
SweepDir read_sweep_dir(const std::string& dir);
/// The same, and goes to the folder that the sweep was planned from: there relative paths in
/// configurations begin, wherever an engine starts us. `path` comes back absolute.
SweepDir enter_sweep_dir(const std::string& dir);

/// What a trial came to; nothing if it is not over. What is damaged, or is of another trial, counts
/// as not there. ReadError if the bytes cannot be had: the trial may be over.
std::optional<tables::TrialResult> read_result(const SweepDir& dir, const std::string& id);
/// The document of the contract, by rename. `seconds` is of the last attempt. `early`: by the
/// sweep's rule, and `error` says why.
void write_result(const SweepDir& dir, const TrialEntry& trial, tables::TrialState state,
                  const std::string& error, const TrialOutcome& outcome, double seconds,
                  bool early = false);

/// Nothing is left to do: it is done, or was stopped early by the rule that the sweep still has.
bool is_over(const SweepDir& dir, const tables::TrialResult& result);

/// Removes drafts of results whose writers were killed. The caller holds the trial's lease.
void remove_drafts(const SweepDir& dir, const std::string& id);
/// Of a trial that is over: what processes that were killed have left in its folder.
void tidy(const SweepDir& dir, const std::string& id);

/// Where a trial stands: a result's state, "running" if somebody holds its lease, or "pending".
struct TrialStatus {
  std::string state, error;
  double seconds = 0;
  std::optional<LeaseHolder> holder;
};
TrialStatus status_of(const SweepDir& dir, const TrialEntry& trial);

/// Asks what runs now to stop.
void request_stop(const std::string& dir);
/// Changes with every request; what runs remembers it and compares.
std::string stop_token(const std::string& dir);

/// The last line of a file that is not blank, at most 300 characters; "" without one.
std::string last_line(const std::string& path);
/// The last lines of a file that are not blank, up to `most`; "" without any.
std::string last_lines(const std::string& path, int most);
/// The sweep file that the folder was planned from, resolved. The working directory must be the one
/// that enter_sweep_dir() goes to.
SweepFile read_planned_file(const SweepDir& dir);

}  // namespace restage::sweep
