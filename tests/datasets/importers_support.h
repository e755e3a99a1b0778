// What the tests of importers look for in reports.
#pragma once

#include <string>

#include "datasets/importers/report.h"
#include "tests/support/files.h"

namespace restage::test {

/// The report's line of this name; empty if it has none.
inline std::string fact(const ImportReport& report, const std::string& name) {
  for (const auto& [key, value] : report.facts)
    if (key == name) return value;
  return "";
}

inline std::string remarks(const ImportReport& report) {
  std::string out;
  for (const std::string& remark : report.remarks) out += remark + "\n";
  return out;
}

}  // namespace restage::test
