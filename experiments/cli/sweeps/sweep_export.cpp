// restage sweep export: a script that lets Slurm, GNU parallel or Snakemake run the trials.
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "autograd/base/shipped.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/export.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  std::string dir, engine, out, program;
};

/// The program that runs now, wherever it was found.
std::string this_program() {
  std::string path = own_program();
  if (path.empty())
    throw WorkError("where this program lies cannot be found out; give it with --program");
  return path;
}

int run_export(const ExportArguments& a, const Common& common) {
  const tables::Engine engine = tables::engine_named(a.engine);
  const auto plan = sweep::read_plan_file(a.dir);
  if (!plan)
    throw InputError(a.dir, "holds no planned sweep (plan.json)",
                     "write it with 'restage sweep plan SWEEP.yaml --out DIR'");
  if (!a.program.empty() && !fs::is_regular_file(a.program))
    throw InputError(a.program, "is no program", "leave --program out to use this one");
  check_output(a.out, {a.dir + "/plan.json", a.dir + "/sweep.yaml", a.program});
  const tables::ExportOptions options{
      a.program.empty() ? this_program() : fs::canonical(a.program).string(),
      fs::canonical(a.dir).string(), common.threads};
  for (const std::string& place : {options.program, options.dir})
    if (engine == tables::Engine::snakemake && valid_utf8(place) != place)
      throw InputError(place, "is no UTF-8, as a Snakefile must be", "rename it");
  write_file_atomically(a.out, tables::export_script(engine, plan->trials, options));
  const std::string start = engine == tables::Engine::slurm ? "sbatch " + a.out
                            : engine == tables::Engine::parallel
                                ? "parallel < " + a.out
                                : "snakemake --cores all -k -s " + a.out;
  print(common.json,
        {{"out", a.out}, {"engine", a.engine}, {"trials", plan->trials.size()}, {"start", start}},
        "wrote " + a.out + ": " + std::to_string(plan->trials.size()) + " trials\nstart it with " +
            start + "\n");
  return 0;
}

}  // namespace

void add_sweep_export(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "export", "a script for Slurm, GNU parallel or Snakemake that runs the trials",
      "restage sweep export runs/smoothness --engine slurm --out s.sbatch && sbatch s.sbatch\n"
      "restage sweep export runs/smoothness --engine parallel --out s.txt && parallel < s.txt\n"
      "restage sweep export runs/s --engine slurm --program /opt/restage/bin/restage --out "
      "s.sbatch\n"
      "restage sweep export runs/smoothness --engine snakemake --out s.smk && "
      "snakemake --cores 4 -k -s s.smk",
      run_export);
  app.add_option("DIR", a.dir, "folder of a planned sweep ('sweep plan --out DIR')").required();
  app.add_option("--engine", a.engine, "slurm, parallel or snakemake").required();
  app.add_option("--out", a.out, "script to write").required();
  app.add_option("--program", a.program, "restage as the machines see it (default: this program)");
}

}  // namespace restage::cli
