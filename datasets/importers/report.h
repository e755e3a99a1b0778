// What an importer found out about a file and did to it: what commands print, `--json` gives whole
// and tests read. Importers themselves print nothing.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "autograd/base/setting_names.h"

namespace restage {

struct ImportReport {
  std::string file;
  std::vector<std::pair<std::string, std::string>> facts;  ///< e.g. {"frame rate", "120 -> 30"}
  std::vector<std::string> remarks;                        ///< what the user should know
  /// Settings in `value` and `text` are named as {fps} (setting_names.h).
  void fact(const std::string& name, const std::string& value) {
    facts.emplace_back(name, spelled(value));
  }
  void remark(const std::string& text) { remarks.push_back(spelled(text)); }
};

}  // namespace restage
