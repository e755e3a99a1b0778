// The options that say how scans and recordings are read.
#pragma once

#include <string>

#include "datasets/schema.h"
#include "experiments/cli/command_options.h"

namespace restage::cli {

/// "0.001", "mm", "cm", "m" ... as metres per unit. InputError naming the option: neither a number
/// nor a known unit.
double metres_per_unit(const std::string& text, const std::string& option = "--scale");

/// --scale of all commands. `value` is a double or an optional one; left as it is without the
/// option. `usual`: what the help page says of that.
template <class Value>
Option add_scale(CommandOptions app, Value& value, const std::string& help,
                 const std::string& usual = "1", const std::string& name = "--scale") {
  return app.add_text(
      name, [&value, name](const std::string& text) { value = metres_per_unit(text, name); },
      help + "; a number or mm, cm, m, in, ft (default: " + usual + ")", ValueKind::number_or_unit);
}

/// --force of all commands: what the doctor would refuse is taken. `help`: what that is here.
Option add_force(CommandOptions app, bool& value, const std::string& help = "");

/// --source-up of all commands that read clouds.
void add_source_up(CommandOptions app, SourceRecord& how);

/// --fps, --source-up, --scale, --clip and --sequence of a source of clouds or of a character.
void add_source_options(CommandOptions app, SourceRecord& how);

}  // namespace restage::cli
