// What an importer found in a file and how it read it; commands print it, --json gives it whole.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace restage {

struct ImportReport {
  std::string file;
  std::vector<std::pair<std::string, std::string>> facts;  ///< what was detected: name and value
  std::vector<std::string> remarks;                        ///< what the user should know of
};

}  // namespace restage
