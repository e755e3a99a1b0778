// Numbers and shares in the doctor's sentences; internal to this folder.
#pragma once

#include <cstdio>
#include <string>

namespace restage::doctor_detail {

/// Three digits: 0.0123, 1.7, 173.
inline std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

inline std::string per_cent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f %%", share < 0.1 && share > 0 ? 1 : 0, 100 * share);
  return text;
}

/// "1 frame", "3 frames".
inline std::string counted(size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

}  // namespace restage::doctor_detail
