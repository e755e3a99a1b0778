// The lines of an OBJ file.
#pragma once

#include <string>
#include <string_view>

#include "datasets/readers/text/text.h"

namespace restage {

/// Lines of an OBJ file; `\` at the end of a vertex or face joins the next one to it.
class ObjLines {
 public:
  explicit ObjLines(std::string_view content) : lines_(content) {}
  bool next(std::string_view& line) {
    if (!lines_.next(line)) return false;
    if (!line.ends_with('\\') || (line[0] != 'v' && line[0] != 'f')) return true;
    joined_ = line;
    while (joined_.ends_with('\\')) {
      joined_.back() = ' ';
      if (!lines_.next(line)) break;
      joined_ += line;
    }
    line = joined_;
    return true;
  }
  int64_t number() const { return lines_.number(); }

 private:
  text::Lines lines_;
  std::string joined_;
};

}  // namespace restage
