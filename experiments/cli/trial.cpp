// restage trial: one trial of a sweep's folder. What every engine calls.
#include <memory>

#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/trial.h"

namespace restage::cli {

void add_trial(Program& program) {
  struct Options {
    std::string dir, id, stage;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& app = program.add(
      "trial", "run one trial of a sweep's folder, start to finish",
      "restage trial runs/smoothness 4f2a90c1d3e5\n"
      "restage trial runs/smoothness 4f2a90c1d3e5 --threads 4",
      [options, &program] {
        const Common& common = program.common();
        if (!options->stage.empty()) {
          sweep::perform_stage(options->dir, options->id, options->stage, common.quiet);
          if (common.json)
            print_json({{"id", options->id}, {"stage", options->stage}});
          else
            print("stage " + options->stage + " of trial " + options->id + " is in the store\n");
          return 0;
        }
        const auto end = sweep::perform_trial(options->dir, options->id, common.quiet);
        const auto result = read_result(sweep::read_sweep_dir(options->dir), options->id);
        const std::string state = result ? result->state : "pending";  // removed since
        if (common.json)
          print_json({{"id", options->id}, {"state", state}});
        else if (end == sweep::TrialEnd::before)
          print("trial " + options->id + " was " + state + " before\n");
        else
          print("trial " + options->id +
                (end == sweep::TrialEnd::done ? " is done\n" : " was stopped early\n"));
        return 0;
      });
  app.add_option("DIR", options->dir, "folder of 'restage sweep plan --out'")->required();
  app.add_option("ID", options->id, "of the trial")->required();
  app.add_option("--stage", options->stage, "make only the artifacts up to this stage");
}

}  // namespace restage::cli
