// The section `search` of a sweep file: keys whose values are drawn instead of listed.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/search/space.h"

namespace restage::sweep {

struct Setting;
struct SweepFile;

struct Search {
  std::string kind;  ///< random, latin or tpe
  int trials = 20;   ///< points; with tpe, of `sweep run`
  int startup = 10;  ///< of tpe: points before results are looked at
  uint64_t seed = 0;
  std::string metric;  ///< less is better: STAGE.FIGURE or SET.METRIC; "": not said
  search::Space space;
  ConfigPlace place, metric_place;
  /// Of tpe: the points that the sweep's folder has asked for so far, in this order.
  std::vector<search::Point> asked = {};

  /// Points follow from results, so each is asked for by itself.
  bool asks() const { return kind == "tpe"; }
  /// Those that trials are planned of.
  std::vector<search::Point> points() const;
  /// Of tpe: the first points, which need no results.
  std::vector<search::Point> first_points() const;
};

/// InputError: unknown keys, a range that is none.
Search search_of(const ConfigNode& node);
/// What search_of() reads back to the same.
ConfigNode search_node(const Search& search);
/// `search.KEY=value` of the command line: `key` is without "search.".
void set_search_key(Search& search, const std::string& key, const ConfigNode& value,
                    const ConfigPlace& place);
/// `key=uniform(a,b)` and the like of the command line.
search::Dimension range_of_word(const std::string& key, const std::string& range,
                                const std::vector<ConfigNode>& ends, const ConfigPlace& place);
/// Fewer points than trials, keys that are also in `set`, `grid`, `zip` or `cases`, and what a
/// search that asks cannot have.
void check_search(const SweepFile& file);

/// The point's keys and values.
std::vector<Setting> settings_at(const search::Space& space, const search::Point& point);
/// The value of a plan's override in its dimension. InputError at `place`: it is none of them.
double coordinate_of(const search::Dimension& dimension, const ConfigNode& value,
                     const std::string& place);

}  // namespace restage::sweep
