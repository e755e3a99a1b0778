// restage sweep export: a script that lets Slurm, GNU parallel or Snakemake run the trials.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/export.h"
#include "experiments/sweep/plan.h"
#include "experiments/sweep/sweep_dir.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kMostThreads = 4;      ///< of a Slurm job, unless somebody says more
constexpr double kTimeForError = 2;  ///< a forecast from a few steps may be so far off
constexpr double kTimeBeside = 600;  ///< seconds of loading and evaluation, which are not forecast
constexpr double kMemoryForError = 1.5;
constexpr int64_t kMemoryStep = 256;  ///< megabytes

struct ExportArguments {
  std::string dir, engine, out, program;
  bool measure = false;
  std::optional<int64_t> megabytes, minutes;
};

/// The most memory that this process has taken so far, megabytes.
int64_t peak_megabytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

/// Takes a few steps of every stage, as one of the trials would, and looks how long they take and
/// how much memory this process needs for it.
void forecast(const std::string& folder, tables::ExportOptions* options) {
  const fs::path before = fs::current_path();
  set_threads(options->threads);
  const sweep::SweepDir dir = sweep::enter_sweep_dir(folder);
  const sweep::Forecast found = sweep::measure(sweep::plan_sweep(sweep::read_planned_file(dir)));
  fs::current_path(before);
  const double seconds = kTimeForError * found.longest + kTimeBeside;
  options->minutes = static_cast<int64_t>(std::ceil(seconds / 60));
  const double megabytes = kMemoryForError * static_cast<double>(peak_megabytes());
  options->megabytes =
      kMemoryStep * static_cast<int64_t>(std::ceil(megabytes / static_cast<double>(kMemoryStep)));
}

/// InputError where the trials have networks in Python, and the script would start this program.
void check_networks(const std::string& folder) {
  const fs::path before = fs::current_path();
  const sweep::SweepFile file = sweep::read_planned_file(sweep::enter_sweep_dir(folder));
  bool any = false;
  for (const auto& [name, tree] : sweep::configurations(file))
    any = any || tree.find("python") != nullptr;
  fs::current_path(before);
  if (any)
    throw InputError(folder, "has networks that are written in Python, which 'restage' cannot run",
                     "give --program a file of two lines: #!/bin/sh, and exec python3 -m restage "
                     "\"$@\"");
}

/// The program that runs now, wherever it was found.
std::string this_program() {
  std::string path = own_program();
  if (path.empty())
    throw WorkError("where this program lies cannot be found out; give it with --program");
  return path;
}

std::string limits_text(const tables::ExportOptions& options) {
  std::string out;
  if (options.megabytes > 0) out += cat(", ", options.megabytes, " MB");
  if (options.minutes > 0) out += cat(", ", options.minutes, " minutes");
  return out;
}

int run_export(const ExportArguments& a, const Common& common) {
  const tables::Engine engine = tables::engine_named(a.engine);
  const auto plan = sweep::read_plan_file(a.dir);
  if (!plan)
    throw InputError(a.dir, "holds no planned sweep (plan.json)",
                     "write it with 'restage sweep plan SWEEP.yaml --out DIR'");
  if (plan->search && plan->search->asks())
    throw InputError(a.dir, "asks for its trials one by one, so no list of them can be exported",
                     "let each machine call 'restage sweep run SWEEP.yaml --out DIR'");
  if (!a.program.empty() && !fs::is_regular_file(a.program))
    throw InputError(a.program, "is no program", "leave --program out to use this one");
  if (a.program.empty()) check_networks(a.dir);
  check_output(a.out, {a.dir + "/plan.json", a.dir + "/sweep.yaml", a.program});
  for (const auto& [name, value] : {std::pair{"--mem", a.megabytes}, {"--time", a.minutes}})
    if (value && (*value < 1 || *value > 1'000'000'000))
      throw InputError("", std::string(name) + " is out of range",
                       std::string("give ") + (name[2] == 'm' ? "megabytes" : "minutes"));
  const bool slurm = engine == tables::Engine::slurm;
  tables::ExportOptions options{
      a.program.empty() ? this_program() : fs::canonical(a.program).string(),
      fs::canonical(a.dir).string(),
      common.threads > 0 ? common.threads
      : slurm            ? std::min(kMostThreads, threads())
                         : 1};
  if (a.measure) forecast(a.dir, &options);
  options.megabytes = a.megabytes.value_or(options.megabytes);
  options.minutes = a.minutes.value_or(options.minutes);
  for (const std::string& place : {options.program, options.dir})
    if (engine == tables::Engine::snakemake && valid_utf8(place) != place)
      throw InputError(place, "is no UTF-8, as a Snakefile must be", "rename it");
  write_file_atomically(a.out, tables::export_script(engine, plan->trials, options));
  const std::string start = engine == tables::Engine::slurm ? "sbatch " + a.out
                            : engine == tables::Engine::parallel
                                ? "parallel < " + a.out
                                : "snakemake --cores all -k -s " + a.out;
  print(common.json,
        {{"out", a.out},
         {"engine", a.engine},
         {"trials", plan->trials.size()},
         {"threads", options.threads},
         {"megabytes", options.megabytes > 0 ? Json(options.megabytes) : Json(nullptr)},
         {"minutes", options.minutes > 0 ? Json(options.minutes) : Json(nullptr)},
         {"start", start}},
        "wrote " + a.out + ": " + counted(plan->trials.size(), "trial") + ", each with " +
            counted(static_cast<size_t>(options.threads), "thread") + limits_text(options) +
            "\nstart it with " + start + "\n");
  return 0;
}

}  // namespace

void add_sweep_export(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "export", "a script for Slurm, GNU parallel or Snakemake that runs the trials",
      "restage sweep export runs/smoothness --engine slurm --out s.sbatch && sbatch s.sbatch\n"
      "restage sweep export runs/smoothness --engine slurm --measure --threads 8 --out s.sbatch\n"
      "restage sweep export runs/smoothness --engine slurm --mem 6000 --time 90 --out s.sbatch\n"
      "restage sweep export runs/smoothness --engine parallel --out s.txt && parallel < s.txt\n"
      "restage sweep export runs/s --engine slurm --program /opt/restage/bin/restage --out "
      "s.sbatch\n"
      "restage sweep export runs/smoothness --engine snakemake --out s.smk && "
      "snakemake --cores 4 -k -s s.smk",
      run_export);
  app.add_option("DIR", a.dir, "folder of a planned sweep ('sweep plan --out DIR')").required();
  app.add_option("--engine", a.engine, "slurm, parallel or snakemake").required();
  app.add_option("--out", a.out, "script to write").required();
  app.add_flag("--measure", a.measure,
               "forecast memory and time of a trial from a few steps, for slurm and snakemake");
  app.add_option("--mem", a.megabytes, "megabytes that a trial may take (default: not said)");
  app.add_option("--time", a.minutes, "minutes that a trial may take (default: not said)");
  app.add_option("--program", a.program, "restage as the machines see it (default: this program)");
}

}  // namespace restage::cli
