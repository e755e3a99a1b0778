// Rows of bodies.csv and MakeHuman's rules from sliders to target weights.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "autograd/base/atomic_file.h"
#include "datasets/importers/bodies/makehuman.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr const char* kMacros[] = {"gender",      "age",     "muscle", "weight",   "height",
                                   "proportions", "african", "asian",  "caucasian"};

std::vector<std::string> split_line(std::string_view line) {
  std::vector<std::string> out;
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  for (size_t at = 0; at <= line.size();) {
    const size_t end = std::min(line.find(',', at), line.size());
    out.emplace_back(line.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

double slider_value(const std::string& text, const std::string& column, const std::string& where) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const double lowest = column.find('/') == std::string::npos ? 0.0 : -1.0;
  if (error != std::errc() || end != text.data() + text.size() ||
      !(value >= lowest && value <= 1.0))
    throw InputError(where, "column " + column + " is '" + text.substr(0, 30) + "'",
                     lowest < 0 ? "give a number from -1 to 1" : "give a number from 0 to 1");
  return value;
}

BodyRecipe recipe_of(const std::vector<std::string>& header, const std::vector<std::string>& cells,
                     const std::string& where) {
  if (cells.size() != header.size())
    throw InputError(where, cat("has ", cells.size(), " columns, the header has ", header.size()),
                     "mend the row");
  BodyRecipe out;
  for (size_t c = 0; c < header.size(); ++c) {
    if (header[c] == "id") out.id = cells[c];
    if (header[c] == "split") out.split = cells[c];
    const bool macro =
        std::find(std::begin(kMacros), std::end(kMacros), header[c]) != std::end(kMacros);
    if (macro || header[c].find('/') != std::string::npos)
      out.values[header[c]] = slider_value(cells[c], header[c], where);
  }
  if (out.id.empty()) throw InputError(where, "has no id", "give each body an id");
  if (out.split != "train" && out.split != "validation" && out.split != "test")
    throw InputError(where, "split is '" + out.split.substr(0, 30) + "'",
                     "write train, validation or test");
  return out;
}

using Factors = std::vector<std::pair<std::string, double>>;

/// Parts of a three-way slider: none below 0.5 is 'max', none above is 'min'.
Factors three_way(double x, const std::string& name) {
  return {{"min" + name, std::max(0.0, 1 - 2 * x)},
          {"average" + name, 1 - std::abs(2 * x - 1)},
          {"max" + name, std::max(0.0, 2 * x - 1)}};
}

Factors age_factors(double age) {
  if (age >= 0.5) return {{"young", 2 - 2 * age}, {"old", 2 * age - 1}};
  const double young = std::max(0.0, (age - 0.1875) * 3.2);
  return {{"young", young}, {"child", std::max(0.0, std::min(1.0, age / 0.1875) - young)}};
}

void add_macros(const std::map<std::string, double>& value, TargetWeights& out) {
  const auto at = [&](const char* name) { return value.at(name); };
  const double races = at("african") + at("asian") + at("caucasian");
  const Factors gender = {{"male", at("gender")}, {"female", 1 - at("gender")}};
  const Factors race = {{"african", at("african") / races},
                        {"asian", at("asian") / races},
                        {"caucasian", at("caucasian") / races}};
  Factors height = three_way(at("height"), "height");
  height.erase(height.begin() + 1);  // there is no target for the average
  const double p = at("proportions");
  const Factors proportions = {{"uncommonproportions", std::max(0.0, 1 - 2 * p)},
                               {"idealproportions", std::max(0.0, 2 * p - 1)}};
  for (const auto& [gender_name, g] : gender)
    for (const auto& [age_name, a] : age_factors(at("age"))) {
      const std::string who = gender_name + "-" + age_name;
      for (const auto& [race_name, r] : race)
        out["macrodetails/" + race_name + "-" + who] = r * g * a;
      for (const auto& [muscle_name, m] : three_way(at("muscle"), "muscle"))
        for (const auto& [weight_name, w] : three_way(at("weight"), "weight")) {
          const double c = g * a * m * w;
          const std::string form = who + "-" + muscle_name + "-" + weight_name;
          out["macrodetails/universal-" + form] = c;
          for (const auto& [name, h] : height)
            out["macrodetails/height/" + form + "-" + name] = c * h;
          for (const auto& [name, q] : proportions)
            out["macrodetails/proportions/" + form + "-" + name] = c * q;
        }
    }
}

}  // namespace

std::vector<BodyRecipe> read_recipes(const std::string& csv) {
  const std::string content = read_file(csv, uint64_t{64} << 20);
  std::vector<BodyRecipe> out;
  std::vector<std::string> header;
  std::set<std::string> ids;
  text::Lines lines(content);
  for (std::string_view line; lines.next(line);) {
    const std::string where = cat(csv, ":", lines.number());
    if (line.find_first_not_of(" \r\t") == std::string_view::npos) continue;
    if (!header.empty()) {
      out.push_back(recipe_of(header, split_line(line), where));
      if (!ids.insert(out.back().id).second)
        throw InputError(where, "the id " + out.back().id + " is there twice", "give each its own");
      const auto& v = out.back().values;
      if (!(v.at("african") + v.at("asian") + v.at("caucasian") > 0))
        throw InputError(where, "african, asian and caucasian are all 0",
                         "give one of them a weight");
      continue;
    }
    header = split_line(line);
    for (const char* name : kMacros)
      if (std::find(header.begin(), header.end(), name) == header.end())
        throw InputError(where, cat("has no column '", name, "'"), "give a bodies.csv");
  }
  if (out.empty()) throw InputError(csv, "holds no bodies", "give a bodies.csv with rows");
  return out;
}

TargetWeights recipe_targets(const BodyRecipe& recipe) {
  TargetWeights out;
  add_macros(recipe.values, out);
  for (const auto& [name, value] : recipe.values)
    if (name.find('/') != std::string::npos && value != 0.0)
      out[name + (value > 0 ? "-incr" : "-decr")] += std::abs(value);
  return out;
}

}  // namespace restage
