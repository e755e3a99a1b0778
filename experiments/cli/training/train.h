// The command `train`, for callers that are no command line (python/) too.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/commands.h"
#include "train/trainer.h"

namespace restage::cli {

struct TrainArguments {
  std::vector<std::string> words;
  int64_t overfit_batches = 0;
  bool fast_dev_run = false, dry_run = false, print_config = false;
  std::string find_rate;  ///< the picture; empty: rates are not sought
  std::string profile;    ///< the trace; empty: nothing is timed
  bool tensorboard = false, csv = false;
  std::vector<TrainObserver*> observers = {};  ///< beside those that the options ask for
};

void add_train_options(CommandOptions app, TrainArguments& a);
/// Trains all stages of a configuration; prints the run's folder first.
int run_train(const TrainArguments& arguments, const Common& common);

}  // namespace restage::cli
