// Configurations by name: those that come with the program.
#pragma once

#include <string>

namespace restage::cli {

/// A file (its .yaml may be left out), or the shipped configuration of that name:
/// "standard/finetune" is configs/standard/finetune.yaml, wherever the program was started.
/// InputError with the nearest name if there is neither.
std::string config_file(const std::string& name);

}  // namespace restage::cli
