// What a budget resolves to: how long each network of each row is trained.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/reproduce/evidence.h"

namespace restage::reproduce {

/// One network of one row.
struct Scheduled {
  std::string table, row, stage, model;
  int64_t parameters = 0;  ///< of what the stage hands on
  int64_t steps = 0, batch = 0;
  double rate = 0;              ///< the first
  std::optional<double> hours;  ///< on this machine, validations apart; none where its data are not
};

/// Those of a table. `words`: of the sweep. Nothing is trained but, for the hours, a step or two of
/// two examples, whose time is scaled to the batch; so minutes and 4 GB are enough for all systems.
/// InputError: the sweep's, and a model's sizes.
std::vector<Scheduled> schedule_of(const Evidence& evidence, const std::string& budget,
                                   const std::vector<std::string>& words);

}  // namespace restage::reproduce
