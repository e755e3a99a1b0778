// Words of the command line that vary a configuration: key=value, key=a,b, key=choice(a,b),
// key=range(start,stop,step), and the ranges of a search: key=uniform(a,b), log_uniform, integer
// and log_integer.
#pragma once

#include <string>
#include <vector>

#include "nn/config/config_tree.h"

namespace restage::sweep {

struct SweepWord {
  std::string text, key;
  std::vector<ConfigNode> values;  ///< YAML each, placed at "override 'text'"
  bool several = false;            ///< an axis (also one of a single value: choice(a))
  std::string range = {};          ///< "uniform" and the like, whose two ends are the values
};

/// A comma inside quotes, brackets or braces divides nothing. range() leaves `stop` out and may
/// have no more than 10,000 values; `step` may be left out (1) or negative. InputError otherwise.
SweepWord read_sweep_word(const std::string& text);

}  // namespace restage::sweep
