// What may be said anew when a training goes on: where its data lie now, more steps, and how often
// it writes something down.
#pragma once

#include <string>
#include <vector>

#include "train/run_provenance.h"
#include "train/training/train_config.h"

namespace restage::cli {

/// The configuration of a run with `overrides` on it. InputError for a key that would change what
/// comes out, by its name.
TrainConfig resumed_config(const std::string& run, const std::vector<std::string>& overrides);

/// The configuration of a run as this program reads it from the keys that the program knew which
/// began the run: other keys have their defaults.
/// `overrides` matter where they say where files of networks lie.
std::string resolved_as_begun(const std::string& run, const std::vector<std::string>& overrides);

/// Makes config.yaml and provenance.json of the run say what holds from now on, and who said it.
/// Nothing is written where nothing changed.
void write_resumed(const std::string& run, const RunInput& input,
                   const std::vector<std::string>& overrides);

}  // namespace restage::cli
