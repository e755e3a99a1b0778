// All sub-commands. A new one: a file x.cpp with `void add_x(Program&)`, a line here and one in
// commands.cpp.
#pragma once

#include "experiments/cli/program.h"

namespace restage::cli {

void add_adapt(Program& program);
void add_assess(Program& program);
void add_benchmark(Program& program);
void add_compare(Program& program);
void add_completion(Program& program);
void add_data(Program& program);
void add_data_build(Program& program, CommandOptions group);  // of `data`, as all add_data_*
void add_data_fetch(Program& program, CommandOptions group);
void add_data_import(Program& program, CommandOptions group);
void add_data_inspect(Program& program, CommandOptions group);
void add_data_merge(Program& program, CommandOptions group);
void add_data_perform(Program& program, CommandOptions group);
void add_data_realism(Program& program, CommandOptions group);
void add_data_sheet(Program& program, CommandOptions group);
void add_data_split(Program& program, CommandOptions group);
void add_doctor(Program& program);
int run_doctor_self(const Common& common);  // doctor --self
void add_eval(Program& program);
void add_info(Program& program);
void add_replay(Program& program);
void add_report(Program& program);
void add_reproduce(Program& program);
void add_retarget(Program& program);
void add_skeleton(Program& program);
void add_stream(Program& program);
void add_sweep(Program& program);
void add_sweep_ask(Program& program, CommandOptions group);  // of `sweep`, as all add_sweep_*
void add_sweep_export(Program& program, CommandOptions group);
void add_sweep_table(Program& program, CommandOptions group);
void add_track(Program& program);
void add_train(Program& program);
void add_view(Program& program);
void add_watch(Program& program);
void add_weights(Program& program);

/// Adds every command, in the order of `restage --help`.
void add_commands(Program& program);

}  // namespace restage::cli
