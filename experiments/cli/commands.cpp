#include "experiments/cli/commands.h"

namespace restage::cli {
void add_sweep(Program& program);
void add_trial(Program& program);

void add_commands(Program& program) {
  add_train(program);
  add_sweep(program);
  add_trial(program);
  add_watch(program);
  add_reproduce(program);
  add_replay(program);
  add_retarget(program);
  add_track(program);
  add_stream(program);
  add_skeleton(program);
  add_adapt(program);
  add_assess(program);
  add_data(program);
  add_eval(program);
  add_benchmark(program);
  add_compare(program);
  add_report(program);
  add_view(program);
  add_info(program);
  add_weights(program);
  add_doctor(program);
  add_completion(program);
}

}  // namespace restage::cli
