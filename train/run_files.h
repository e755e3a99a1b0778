// Inside of train/run: names, search and pruning of checkpoints, and the cut of metrics.jsonl.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "train/run.h"

namespace restage::run_files {

/// A checkpoint file by its name; its bytes are not looked at.
struct Entry {
  std::string path, stage, checksum;
  int64_t step = 0;
};

std::string checkpoint_name(const std::string& stage, int64_t step, std::string_view bytes);
/// Files in `dir`/checkpoints whose names checkpoint_name could have made, oldest first: in the
/// order of `stages`, then of the steps. Other files and stages are ignored.
std::vector<Entry> list_checkpoints(const std::string& dir, const std::vector<std::string>& stages);
/// The newest of `entries` (oldest first) that can be read and fits its checksum; what is wrong
/// with the checkpoints after it is added to `passed_over`, each in a line.
std::optional<Checkpoint> newest_good(const std::vector<Entry>& entries,
                                      std::vector<std::string>& passed_over);
/// Removes those of `entries` (of one stage, oldest first) that the rule does not keep.
void prune(const std::vector<Entry>& entries, const KeepRule& keep);
/// Removes temporary files that a killed process left.
void remove_leftovers(const std::string& dir);
/// Keeps the lines of metrics.jsonl up to `last` (none: no lines); drops torn and foreign lines.
void cut_metrics(const std::string& dir, const std::vector<std::string>& stages,
                 const std::optional<Checkpoint>& last);

}  // namespace restage::run_files
