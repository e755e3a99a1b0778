// restage sweep: the group. Stands in for the file that plans and runs sweeps.
#include "experiments/cli/commands.h"

namespace restage::cli {

void add_sweep(Program& program) {
  CLI::App& group = program.add_group("sweep", "many trainings from one file");
  add_sweep_table(program, group);
  add_sweep_export(program, group);
}

}  // namespace restage::cli
