// What an importer found in a file and what it did, for people and for programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace restage {

struct ImportReport {
  std::string file;
  std::vector<std::pair<std::string, std::string>> facts;  ///< ("up", "z, by the rest pose")
  std::vector<std::string> remarks;                        ///< what somebody should look at
};

}  // namespace restage
