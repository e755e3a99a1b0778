// Configurations by name: those that come with the program.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// The names of those of trainings: "demo", "standard/finetune", ...
std::vector<std::string> shipped_configs();
/// The file of that name ("standard/finetune" is configs/standard/finetune.yaml, wherever the
/// program was started); empty if there is none.
std::string shipped_config(const std::string& name);
/// A file (its .yaml may be left out), or the shipped configuration of that name. InputError with
/// the nearest name if there is neither.
std::string config_file(const std::string& name);

}  // namespace restage
