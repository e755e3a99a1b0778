// Scripts that let another engine run a sweep's trials. They only distribute: every job is
// `restage trial DIR ID`, which does nothing if DIR/trials/ID/result.json says that the trial is
// done and goes on where it was left otherwise. So an engine may be killed, restarted or given the
// script twice, and its own log never decides what is done.
#pragma once

#include <string>
#include <vector>

#include "experiments/sweep/results.h"

namespace restage::tables {

enum class Engine { slurm, parallel, snakemake };
/// InputError with the nearest name if there is none.
Engine engine_named(const std::string& name);

struct ExportOptions {
  std::string program;    ///< restage, absolute
  std::string dir;        ///< of the sweep, absolute
  int threads = 1;        ///< of a trial
  int64_t megabytes = 0;  ///< that a trial may take; 0: not said
  int64_t minutes = 0;    ///< that a trial may take; 0: not said
};

/// The script. slurm: for `sbatch FILE`, an array of at most 1,000 tasks (Slurm's default limit),
/// which share the trials among them; two minutes before a task's time is up its trial writes a
/// checkpoint, and the task is queued again. parallel: for `parallel < FILE`, a command a line.
/// snakemake: for `snakemake -s FILE`; artifacts that several trials use are jobs of their own,
/// made before the trials by `restage trial DIR ID --stage STAGE`. InputError: a path that the
/// engine cannot be told (line breaks; for snakemake also braces).
std::string export_script(Engine engine, const std::vector<sweep::TrialEntry>& plan,
                          const ExportOptions& options);

}  // namespace restage::tables
