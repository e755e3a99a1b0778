// restage doctor SOURCE --people: who is in a sequence of clouds, and each of them by themselves.
#pragma once

#include <optional>
#include <string>

#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {

/// Follows everybody through the clouds of `source`, says who is seen in how many frames, and
/// writes `out` (HDF5, if it is given): a sequence for each person, as many frames as the source
/// has; a frame that does not show the person has no points. InputError: nobody, `out` that is no
/// HDF5.
int run_doctor_people(const SourceRecord& source, const std::optional<std::string>& out,
                      const Common& common);

}  // namespace restage::cli
