// What the values of config structs must fulfil; all that a struct with a visit() needs to include.
// Keys are listed and read by nn/config/config_reader.h.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace restage {

/// What a value must fulfil; of a list, what each of its items must fulfil.
struct Rule {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;  ///< the bound itself is not allowed
  std::vector<std::string> choices;          ///< allowed texts (empty: all)
  bool required = false;                     ///< the key must be given
  /// Of a key that was added later: the value that was fixed before, as YAML. An identity leaves
  /// the key out where it has that value, so ids stay what they were (write_identity()).
  std::string fixed_before = "";
};
inline Rule above(double low) { return {.low = low, .low_open = true, .choices = {}}; }
inline Rule at_least(double low) { return {.low = low, .choices = {}}; }
inline Rule positive() { return above(0); }
inline Rule between(double low, double high) { return {.low = low, .high = high, .choices = {}}; }
/// low <= value < high: dropout rates, decays.
inline Rule below(double low, double high) {
  return {.low = low, .high = high, .high_open = true, .choices = {}};
}
inline Rule one_of(std::vector<std::string> choices) { return {.choices = std::move(choices)}; }
inline Rule required(Rule rule = {}) {
  rule.required = true;
  return rule;
}

/// A key that was added when all that had been trained had the value `fixed_before`.
inline Rule added(std::string fixed_before, Rule rule = {}) {
  rule.fixed_before = std::move(fixed_before);
  return rule;
}

/// The names of an enum's values in YAML: `inline EnumNames<E> config_names(E) { return {{"a",
/// E::a}}; }`
template <class E>
using EnumNames = std::vector<std::pair<std::string, E>>;

/// Limits of sizes in files: no network here needs more, so a larger number is a mistake.
inline constexpr int64_t kMostPoints = 1 << 16, kMostWidth = 1 << 14;

}  // namespace restage
