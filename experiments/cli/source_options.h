// --scale of all commands that read scans and recordings: metres per unit, or the unit's name.
#pragma once

#include <string>

#include "experiments/cli/command_options.h"

namespace restage::cli {

/// "0.001", "mm", "cm", "m" ... as metres per unit. InputError: neither a number nor a known unit.
double metres_per_unit(const std::string& text);

/// `value` is a double or an optional one; left as it is without the option.
template <class Value>
Option add_scale(CommandOptions app, Value& value, const std::string& help) {
  return app.add_text(
      "--scale", [&value](const std::string& text) { value = metres_per_unit(text); },
      help + "; a number or mm, cm, m, in, ft");
}

}  // namespace restage::cli
