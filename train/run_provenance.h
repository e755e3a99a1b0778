// Where a run's numbers come from: what a reader needs to repeat it. Holds nothing about the
// machine but its processor (no host name, no user).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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
};

/// JSON with version, git_commit, compiler, flags, processor, simd, threads, seed, data,
/// command_line, started (UTC) and configuration ({"dotted.key": "value"}).
std::string provenance_json(const RunInput& input);
/// InputError naming what has changed since the run in `dir` was made: its data, its config.yaml,
/// the seed. A run goes on with the same bits or not at all.
void check_same_run(const std::string& dir, const RunInput& input);

}  // namespace restage
