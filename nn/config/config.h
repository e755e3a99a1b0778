// Configuration: strict YAML with includes and `key=value` overrides into typed structs.
//
//   struct StageConfig { int64_t steps = 1000; int batch = 16; ScheduleConfig schedule; };
//   template <class V> void visit(V& v, StageConfig& c) {       // the keys are listed once, here
//     v("steps", c.steps, "optimiser steps", at_least(0));
//     v("batch", c.batch, "examples per step", positive());
//     v("schedule", c.schedule, "learning rate");               // a struct with a visit of its own
//   }
//   TrainConfig c;
//   const ConfigNode tree = load_config("configs/demo.yaml", {"skeleton.batch=8"}, c);
//   write_file_atomically("config.yaml", resolved_yaml(c));
//
// Every error is an InputError of one line: `file:line: what is wrong; how to mend it`.
#pragma once

#include <string>
#include <vector>

#include "nn/config/config_reader.h"

namespace restage {

/// `name` as it is seen from the folder of `file`; absolute names, and those that begin with ~/ or
/// a variable, stay as they are.
std::string seen_from(const std::string& file, const std::string& name);

/// Reads a file with its includes (`include: other.yaml` or a list, at the top level, relative to
/// the including file; the file's own keys win, then later includes), then lays the overrides on
/// it. In values, and names of included files, `${oc.env:NAME}` and `${oc.env:NAME,DEFAULT}` stand
/// for variables of the environment, as in OmegaConf, and `~/` at the beginning for the home
/// folder. The names in the list `python` are seen from the file, too. Errors: a missing file, an
/// include cycle, a variable that holds `${` itself, more than kConfigMaxFiles files, and those of
/// parse_yaml.
ConfigNode load_config_tree(const std::string& path,
                            const std::vector<std::string>& overrides = {});

/// Reads a file as load_config_tree() does, into a struct. Keys that the file does not give keep
/// the values of `config`. Returns the tree, for config_error().
template <class C>
ConfigNode load_config(const std::string& path, const std::vector<std::string>& overrides,
                       C& config) {
  ConfigNode tree = load_config_tree(path, overrides);
  read_config(tree, config);
  return tree;
}

/// All keys of a struct with their values; reading it gives an equal struct.
template <class C>
std::string resolved_yaml(const C& config) {
  return config_to_yaml(write_config(config));
}

}  // namespace restage
