// What lines of MakeHuman's text files have in common: vertices of the base mesh by number.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "datasets/readers/text/word_lines.h"

namespace restage {

constexpr const char* kFetchAgain = "fetch the file again";

/// The vertex that a word names ("12", "12/7" in OBJ), `first` being the number of the first one.
/// InputError at the line if there is none among `limit`.
inline int32_t vertex_named(const WordLines& lines, std::string_view word, int first,
                            size_t limit) {
  const double value = lines.number(word.substr(0, word.find('/'))) - first;
  if (!(value >= 0 && value < static_cast<double>(limit)) || value != std::floor(value))
    lines.fail("names a vertex that does not exist", kFetchAgain);
  return static_cast<int32_t>(value);
}

}  // namespace restage
