// Where a run's numbers come from: what a reader needs to repeat it. Holds nothing about the
// machine but its processor (no host name, no user).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/config/config_tree.h"

namespace restage {

struct RunInput {
  uint64_t seed = 0;
  int threads = 0;
  std::vector<std::string> command_line;
  struct DataFile {
    std::string path, checksum;  ///< as restage::checksum of its bytes
  };
  std::vector<DataFile> data;  ///< empty: the built-in source
  std::string resolved_yaml;   ///< the configuration
  /// A network that is written in Python.
  struct Network {
    std::string stage, model;
    std::string source;  ///< a checksum
  };
  std::vector<Network> networks = {};
};

/// JSON with version, git_commit, compiler, flags, processor, simd, threads, seed, data,
/// command_line, started (UTC), networks ({"stage": {"model", "source"}}; only where one is written
/// in Python) and configuration ({"dotted.key": "value"}).
std::string provenance_json(const RunInput& input);
/// InputError naming what has changed since the run in `dir` was made: its data, its config.yaml,
/// the seed, the source of networks in Python (a run that does not know it is taken as it is). A
/// run goes on with the same bits or not at all, but for keys that `overrides` (key=value) name. A
/// program that began the run may know fewer keys than this one: a key that it did not know must
/// have its default, which `defaults` has (known_then(), resolved).
void check_same_run(const std::string& dir, const RunInput& input,
                    const std::vector<std::string>& overrides, const std::string& defaults);
/// `tree`, the configuration of the run in `dir`, without what the program that began the run did
/// not know.
ConfigNode known_then(const std::string& dir, ConfigNode tree);

}  // namespace restage
