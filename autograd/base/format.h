// printf's patterns as strings, for numbers in messages.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace restage {

/// At most 511 characters; the rest is cut off.
[[gnu::format(printf, 1, 2)]] inline std::string format(const char* pattern, ...) {
  char text[512];
  va_list values;
  va_start(values, pattern);
  std::vsnprintf(text, sizeof text, pattern, values);
  va_end(values);
  return text;
}

}  // namespace restage
