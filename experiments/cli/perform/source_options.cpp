#include "experiments/cli/perform/source_options.h"

#include <charconv>
#include <map>

#include "autograd/base/error.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::cli {

double metres_per_unit(const std::string& text, const std::string& option) {
  static const std::map<std::string, double> units = {
      {"mm", 0.001},  {"millimetre", 0.001}, {"millimeter", 0.001},
      {"cm", 0.01},   {"centimetre", 0.01},  {"centimeter", 0.01},
      {"dm", 0.1},    {"decimetre", 0.1},    {"decimeter", 0.1},
      {"m", 1},       {"metre", 1},          {"meter", 1},
      {"km", 1000},   {"kilometre", 1000},   {"kilometer", 1000},
      {"in", 0.0254}, {"inch", 0.0254},      {"inches", 0.0254},
      {"ft", 0.3048}, {"foot", 0.3048},      {"feet", 0.3048}};
  std::string name = lower_case(text);
  if (units.count(name) == 0 && name.size() > 3 && name.ends_with('s')) name.pop_back();
  if (const auto unit = units.find(name); unit != units.end()) return unit->second;
  const size_t plus = text.size() > 1 && text[0] == '+' ? 1 : 0;
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + plus, end, value);
  if (error != std::errc() || stop != end)
    throw InputError("",
                     option + " '" + text.substr(0, 40) + "' is neither a number nor a known unit",
                     "give metres per unit, such as 0.001, or mm, cm, m, in or ft");
  return value;
}

void add_source_up(CommandOptions app, SourceRecord& how) {
  app.add_text(
      "--source-up",
      [&how](const std::string& axis) {
        how.up = axis;
        how.up_known = true;
      },
      "the source's axis that points up: x, -x, y, -y, z or -z (default: y)");
}

void add_source_options(CommandOptions app, SourceRecord& how) {
  app.add_option("--clip", how.clip,
                 "animation of a glTF source (default: the first), or motion of a file of motions");
  app.add_option("--sequence", how.sequence,
                 "which sequence of an HDF5 source, from 0 (default: the only one)");
  app.add_option("--fps", how.fps,
                 "frames per second of the source (default: the file's, else 30)");
  add_source_up(app, how);
  add_scale(app, how.scale, "the source's units in metres");
}

Option add_force(CommandOptions app, bool& value, const std::string& help) {
  return app.add_flag("--force", value,
                      "take what the doctor would refuse" + (help.empty() ? "" : ": " + help));
}

}  // namespace restage::cli
