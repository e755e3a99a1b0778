// Runs and trials side by side: what differs in their configurations, their final figures, their
// curves. A run is a folder of `restage train`; a trial is DIR/trials/ID of a sweep, whose curves
// are those of the artifacts that it used (STORE/STAGE-ID/metrics.jsonl).
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace restage::tables {

struct Compared {
  std::string name;                           ///< as given
  std::map<std::string, std::string> config;  ///< dotted key to value as YAML on one line
  /// "motion.pa_mpjpe" (stage and value of metrics.jsonl) to (step, value), in order of the file.
  std::map<std::string, std::vector<std::pair<double, double>>> curves;
  /// The last value of every curve, and what result.json says: "naked: mpjpe".
  std::map<std::string, double> figures;
};

/// InputError: neither a run nor a trial. Lines of metrics.jsonl that cannot be read are passed by
/// (a running training writes the last one).
Compared read_compared(const std::string& folder);

/// Keys whose values are not the same in all, a key that is missing being different.
std::vector<std::string> differing_keys(const std::vector<Compared>& all);

std::string comparison_markdown(const std::vector<Compared>& all);
nlohmann::ordered_json comparison_json(const std::vector<Compared>& all);
/// A panel for every curve that one of them has.
std::string comparison_svg(const std::vector<Compared>& all);

}  // namespace restage::tables
