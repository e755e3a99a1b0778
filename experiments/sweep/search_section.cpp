#include "experiments/sweep/search_section.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "experiments/search/tpe.h"
#include "experiments/sweep/sweep_file.h"
#include "nn/config/config_reader.h"

namespace restage::sweep {
namespace {

using Kind = ConfigNode::Kind;
using search::Dimension;

constexpr int kMostPointsOfASearch = 10'000;
const std::vector<std::string> kSearchKeys = {"kind", "trials", "startup",
                                              "seed", "metric", "space"};
const std::vector<std::string> kRanges(std::begin(search::kDimensionKinds),
                                       std::end(search::kDimensionKinds));

[[noreturn]] void refuse(const ConfigPlace& place, const std::string& wrong,
                         const std::string& fix) {
  throw InputError(place.text(), wrong, fix);
}

bool is_range(const ConfigNode& node) {
  return node.kind == Kind::map && node.children.size() == 1 &&
         std::find(kRanges.begin(), kRanges.end(), node.children[0].key) != kRanges.end();
}

Dimension dimension_of(const std::string& key, const ConfigNode& node) {
  const ConfigNode& values = node.children[0];
  const auto kind = std::find(kRanges.begin(), kRanges.end(), values.key) - kRanges.begin();
  Dimension out{key, static_cast<Dimension::Kind>(kind)};
  out.place = node.key_place;
  if (values.kind != Kind::list || values.children.empty())
    refuse(values.place, in_quotes(key) + " needs a list", "write {" + values.key + ": [a, b]}");
  if (out.kind == Dimension::Kind::choice) {
    out.choices = values.children;
    for (size_t i = 0; i < out.choices.size(); ++i)
      for (size_t j = 0; j < i; ++j)
        if (same_value(out.choices[i], out.choices[j]))
          refuse(out.choices[i].place, "the value " + value_text(out.choices[i]) + " stands twice",
                 "keep one");
    return out;
  }
  if (values.children.size() != 2)
    refuse(values.place, in_quotes(key) + " needs the lowest and the highest value",
           "write {" + values.key + ": [low, high]}, or {choice: [a, b, c]}");
  for (const auto& [child, end] : {std::pair{0, &out.low}, {1, &out.high}}) {
    const ConfigNode& number = values.children[static_cast<size_t>(child)];
    config_detail::read_leaf(number, key, {}, *end);
    if (!std::isfinite(*end) || (out.whole() && *end != std::round(*end)))
      refuse(number.place, "the end " + in_quotes(number.text) + " is no whole number",
             "give whole numbers, or use uniform or log_uniform");
  }
  if (out.low >= out.high)
    refuse(values.place, in_quotes(key) + " goes from high to low, or nowhere",
           "write the lower value first, or put a single one into 'set'");
  if (out.logarithmic() && out.low < (out.whole() ? 1 : 1e-300))
    refuse(values.place,
           in_quotes(key) + " is logarithmic and begins at " + values.children[0].text,
           out.whole() ? "begin at 1 or above" : "begin above 0");
  return out;
}

/// Nested sections are opened; a range ends the key.
void read_space(const ConfigNode& node, const std::string& prefix, search::Space& out) {
  for (const ConfigNode& entry : node.children) {
    const std::string key = prefix + entry.key;
    if (is_range(entry)) {
      check_config_key(key, entry.key_place);
      for (const Dimension& other : out)
        if (other.key == key)
          refuse(entry.key_place, in_quotes(key) + " stands here a second time", "keep one");
      out.push_back(dimension_of(key, entry));
    } else if (entry.kind == Kind::map && !entry.children.empty()) {
      read_space(entry, key + ".", out);
    } else {
      const std::string close = nearest(entry.key, kRanges);
      refuse(entry.key_place, in_quotes(key) + " says no range of values",
             close.empty()
                 ? "write " + in_quotes(key + ": {uniform: [0, 1]}") + ", or " + joined(kRanges)
                 : "did you mean " + in_quotes(close) + "?");
    }
  }
}

template <class T>
void read_key(const ConfigNode& map, const char* key, const Rule& rule, T& value) {
  if (const ConfigNode* node = map.find(key))
    config_detail::read_leaf(*node, std::string("search.") + key, rule, value);
}

ConfigNode named(const std::string& key, ConfigNode value) {
  value.key = key;
  return value;
}

}  // namespace

std::vector<search::Point> Search::first_points() const {
  std::vector<search::Told> told;
  while (std::ssize(told) < std::min(startup, trials)) {
    auto point = search::propose(space, told, {seed, startup});
    if (!point) break;
    told.push_back({std::move(*point), {}});
  }
  std::vector<search::Point> out;
  for (search::Told& one : told) out.push_back(std::move(one.point));
  return out;
}

std::vector<search::Point> Search::points() const {
  if (asks()) return asked;
  return kind == "latin" ? search::latin_points(space, seed, trials)
                         : search::random_points(space, seed, trials);
}

Search search_of(const ConfigNode& node) {
  const std::string example = "write {kind: random, trials: 20, space: {KEY: {uniform: [0, 1]}}}";
  if (node.kind != Kind::map) refuse(node.place, "'search' must be a section", example);
  for (const ConfigNode& entry : node.children) {
    if (std::find(kSearchKeys.begin(), kSearchKeys.end(), entry.key) != kSearchKeys.end()) continue;
    const std::string close = nearest(entry.key, kSearchKeys);
    refuse(entry.key_place, "unknown key " + in_quotes(entry.key) + " of 'search'",
           close.empty() ? "the keys here are " + joined(kSearchKeys)
                         : "did you mean " + in_quotes(close) + "?");
  }
  Search out;
  out.place = out.metric_place = node.key_place;
  if (node.find("kind") == nullptr) refuse(node.key_place, "'search' needs a 'kind'", example);
  read_key(node, "kind", one_of({"random", "latin", "tpe"}), out.kind);
  read_key(node, "trials", between(1, kMostPointsOfASearch), out.trials);
  read_key(node, "startup", between(1, kMostPointsOfASearch), out.startup);
  read_key(node, "seed", {}, out.seed);
  read_key(node, "metric", {}, out.metric);
  if (const ConfigNode* metric = node.find("metric")) out.metric_place = metric->place;
  const ConfigNode* space = node.find("space");
  if (space == nullptr || space->kind != Kind::map || space->children.empty())
    refuse(node.key_place, "'search' needs a 'space'", example);
  read_space(*space, "", out.space);
  if (!out.asks() && node.find("startup") != nullptr)
    refuse(node.find("startup")->key_place, "'startup' is for kind: tpe", "remove it");
  return out;
}

ConfigNode search_node(const Search& search) {
  namespace d = config_detail;
  ConfigNode out, space;
  out.kind = space.kind = Kind::map;
  out.children = {named("kind", d::write_leaf(search.kind)),
                  named("trials", d::write_leaf(search.trials))};
  if (search.asks()) out.children.push_back(named("startup", d::write_leaf(search.startup)));
  out.children.push_back(named("seed", d::write_leaf(search.seed)));
  if (!search.metric.empty()) out.children.push_back(named("metric", d::write_leaf(search.metric)));
  for (const Dimension& dimension : search.space) {
    ConfigNode values, range;
    values.kind = Kind::list;
    range.kind = Kind::map;
    if (dimension.kind == Dimension::Kind::choice)
      values.children = dimension.choices;
    else
      for (const double end : {dimension.low, dimension.high}) {
        ConfigNode number;
        number.kind = Kind::scalar;
        number.text = search::number_text(end);
        values.children.push_back(std::move(number));
      }
    range.children = {named(kRanges[static_cast<size_t>(dimension.kind)], std::move(values))};
    space.children.push_back(named(dimension.key, std::move(range)));
  }
  out.children.push_back(named("space", std::move(space)));
  return out;
}

void set_search_key(Search& search, const std::string& key, const ConfigNode& value,
                    const ConfigPlace& place) {
  if (key == "space") refuse(place, "the space is said by the sweep file", "change it there");
  ConfigNode node = search_node(search);
  node.place = node.key_place = search.place;
  ConfigNode given = named(key, value);
  given.place = given.key_place = place;
  // Going over to another kind leaves the startup of tpe behind.
  if (key == "kind")
    std::erase_if(node.children, [](const ConfigNode& entry) { return entry.key == "startup"; });
  if (ConfigNode* there = node.find(key))
    *there = std::move(given);
  else
    node.children.push_back(std::move(given));
  search::Space space = std::move(search.space);  // with the places of the file
  search = search_of(node);
  search.space = std::move(space);
}

Dimension range_of_word(const std::string& key, const std::string& range,
                        const std::vector<ConfigNode>& ends, const ConfigPlace& place) {
  ConfigNode list, node;
  list.kind = Kind::list;
  list.key = range;
  list.children = ends;
  list.place = place;
  node.kind = Kind::map;
  node.key_place = place;
  node.children = {std::move(list)};
  return dimension_of(key, node);
}

void check_search(const SweepFile& file) {
  const Search& search = *file.search;
  const auto twice = [](const Dimension& dimension, const char* where) {
    refuse(dimension.place, in_quotes(dimension.key) + " is searched and stands in " + where,
           "keep one of the two");
  };
  const auto has = [](const Settings& settings, const std::string& key) {
    return std::any_of(settings.begin(), settings.end(),
                       [&](const Setting& setting) { return setting.key == key; });
  };
  for (const Dimension& dimension : search.space) {
    if (dimension.key == "seed")
      refuse(dimension.place, "a seed is no value to search for", "write seeds: [1, 2]");
    if (has(file.set, dimension.key)) twice(dimension, "'set'");
    for (const Axis& axis : file.axes)
      if (std::find(axis.keys.begin(), axis.keys.end(), dimension.key) != axis.keys.end())
        twice(dimension, "'grid' or 'zip'");
    for (const Case& one : file.cases)
      if (has(one.settings, dimension.key)) twice(dimension, "a case");
  }
  const double size = search::size_of(search.space);
  if (!search.asks() && size < search.trials)
    refuse(search.place, "the space has only " + search::number_text(size) + " points",
           "ask for fewer 'trials', or use 'grid'");
  if (!search.asks()) return;
  if (search.metric.empty())
    refuse(search.place, "a search by tpe needs a 'metric'",
           "name a figure that should become small, such as metric: motion.pa_mpjpe");
  const bool one_case = file.cases.size() == 1 && file.cases[0].name.empty();
  if (!file.axes.empty() || !one_case || !file.exclude.empty())
    refuse(search.place, "a search by tpe asks for one trial after the other",
           "leave grid, zip, cases and exclude out; a key with listed values is {choice: [a, b]}");
  if (file.seeds.size() > 1)
    refuse(search.place, "a search by tpe has one seed, not " + std::to_string(file.seeds.size()),
           "give one, and train the best trial again with others");
}

Settings settings_at(const search::Space& space, const search::Point& point) {
  Settings out;
  for (size_t d = 0; d < space.size(); ++d)
    out.push_back({space[d].key, search::node_of(space[d], point[d])});
  return out;
}

double coordinate_of(const Dimension& dimension, const ConfigNode& value,
                     const std::string& place) {
  if (dimension.kind == Dimension::Kind::choice) {
    for (size_t c = 0; c < dimension.choices.size(); ++c)
      if (same_value(dimension.choices[c], value)) return static_cast<double>(c);
    throw InputError(place, value_text(value) + " is no value of " + in_quotes(dimension.key),
                     "its values are " + cut_list(dimension.choices, 200, value_text));
  }
  double out = 0;
  config_detail::read_leaf(value, dimension.key, {}, out);
  if (!(out >= dimension.low && out <= dimension.high) ||
      (dimension.whole() && out != std::round(out)))
    throw InputError(place, value_text(value) + " lies outside of " + in_quotes(dimension.key),
                     "give a value from " + search::number_text(dimension.low) + " to " +
                         search::number_text(dimension.high));
  return out;
}

}  // namespace restage::sweep
