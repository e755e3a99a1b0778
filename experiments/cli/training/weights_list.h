// restage weights list: the weights that come with the program, and which of them is for what.
#pragma once

#include "experiments/cli/commands.h"

namespace restage::cli {

void add_weights_list(Program& program, CommandOptions group);

}  // namespace restage::cli
