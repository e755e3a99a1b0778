// A file beside what it was made from, and beside the truth: the rows of a sheet, the views of a
// page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/pictures/clips.h"
#include "experiments/pictures/look.h"

namespace restage {

/// What is drawn beside a file, and how it is read.
struct Comparison {
  bool remembered = false;  ///< what the file says that it was made from, if that is still there
  bool needed = false;      ///< a file that does not say it is an InputError
  std::string source;       ///< what else it was made from; empty: only what is remembered
  std::string truth;        ///< the true motion; empty: it is not known
  // What is said of the source; else the source is read as the file remembers.
  std::optional<std::string> clip, up;
  std::optional<double> fps, scale;
  std::optional<int64_t> sequence;
};

struct Rows {
  std::vector<Clip> clips;  ///< source, file, truth: those that there are
  size_t result = 0;        ///< which of them is the file
  std::string source;       ///< path of the source that is drawn; empty: none
  double close_up = 0;      ///< of Look, as SheetOptions::close_up
  Remarks remarks;
};

/// All at the file's moments and rate; where there is no source, Comparison::fps states it anew.
/// InputError: read_clip()'s, a truth of
/// another length, a close-up of files that do not say where joints are.
Rows read_rows(const SourceRecord& file, const Comparison& how, const Look& look,
               uint64_t max_memory);

}  // namespace restage
