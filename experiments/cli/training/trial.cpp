// restage trial: one trial of a sweep's folder. What every engine calls.
#include "experiments/sweep/trial.h"

#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/pool.h"

namespace restage::cli {
namespace {

struct TrialOptions {
  std::string dir, id, stage;
  int ends_with = 0;  ///< a process; 0: none
};

int run_trial(const TrialOptions& o, const Common& common) {
  if (o.ends_with > 0) sweep::end_with(o.ends_with);
  if (!o.stage.empty()) {
    sweep::perform_stage(o.dir, o.id, o.stage, common.quiet);
    print(common.json, {{"id", o.id}, {"stage", o.stage}},
          "stage " + o.stage + " of trial " + o.id + " is in the store\n");
    return 0;
  }
  const auto end = sweep::perform_trial(o.dir, o.id, common.quiet);
  const auto result = read_result(sweep::read_sweep_dir(o.dir), o.id);
  const std::string state =
      result ? tables::kTrialStates[static_cast<int>(result->state)] : "pending";  // removed since
  const std::string said = end == sweep::TrialEnd::before ? "was " + state + " before"
                           : end == sweep::TrialEnd::done ? "is done"
                                                          : "was stopped early";
  print(common.json, {{"id", o.id}, {"state", state}}, "trial " + o.id + " " + said + "\n");
  return 0;
}

}  // namespace

void add_trial(Program& program) {
  auto [app, options] = program.add("trial", "run one trial of a sweep's folder, start to finish",
                                    "restage trial runs/smoothness 4f2a90c1d3e5\n"
                                    "restage trial runs/smoothness 4f2a90c1d3e5 --threads 4\n"
                                    "restage trial runs/smoothness 4f2a90c1d3e5 --stage skeleton\n"
                                    "restage trial runs/smoothness 4f2a90c1d3e5 --ends-with $$",
                                    run_trial);
  app.add_option("DIR", options.dir, "folder of 'restage sweep plan --out'").required();
  app.add_option("ID", options.id, "of the trial").required();
  app.add_option("--stage", options.stage,
                 "make only the artifacts up to this stage (default: all)");
  app.add_option("--ends-with", options.ends_with,
                 "process that starts this one: when it ends, the trial writes a checkpoint and "
                 "ends (default: none)");
}

}  // namespace restage::cli
