#include "nn/config/config_reader.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

using Kind = ConfigNode::Kind;

constexpr size_t kLongest = 150;  // an error is one line of less than 400 characters

/// What the file holds, for "got ...".
std::string got(const ConfigNode& node) {
  switch (node.kind) {
    case Kind::null:
      return "nothing";
    case Kind::list:
      return "a list";
    case Kind::map:
      return "a section";
    case Kind::scalar:
      break;
  }
  return (node.quoted ? "the text " : "") + in_quotes(node.text);
}

template <class T>
std::string shortest(T value) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

/// 100000, not 1e+05.
std::string bound(double value) {
  const bool whole = std::abs(value) < 1e15 && value == std::round(value);
  return whole ? shortest(static_cast<int64_t>(value)) : shortest(value);
}

/// The range of a rule: " > 0", " from 0 to 1".
std::string range_text(const Rule& rule) {
  const bool low = std::isfinite(rule.low), high = std::isfinite(rule.high);
  if (low && high && !rule.low_open && !rule.high_open)
    return " from " + bound(rule.low) + " to " + bound(rule.high);
  std::string out;
  if (low) out += (rule.low_open ? " > " : " >= ") + bound(rule.low);
  if (low && high) out += " and";
  if (high) out += (rule.high_open ? " < " : " <= ") + bound(rule.high);
  return out;
}

bool in_range(const Rule& rule, double value) {
  return (rule.low_open ? value > rule.low : value >= rule.low) &&
         (rule.high_open ? value < rule.high : value <= rule.high);
}

/// The whole text as a number of type T; nothing if it is not one or does not fit.
template <class T>
std::optional<T> parse(const ConfigNode& node) {
  if (node.kind != Kind::scalar || node.quoted || node.text.empty()) return {};
  T value{};
  const char* end = node.text.data() + node.text.size();
  const auto result = std::from_chars(node.text.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) return {};
  return value;
}

template <class T>
void read_number(const ConfigNode& node, const std::string& path, const Rule& rule, T& value) {
  const auto parsed = parse<T>(node);
  bool good = parsed && in_range(rule, static_cast<double>(*parsed));
  if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(*parsed);
  if (!good) config_detail::fail_type(node, path, config_detail::leaf_type(T{}, rule));
  value = *parsed;
}

ConfigNode scalar(std::string text, bool is_quoted = false) {
  ConfigNode node;
  node.kind = Kind::scalar;
  node.text = std::move(text);
  node.quoted = is_quoted;
  return node;
}

/// Texts that YAML or this reader would take for something else stand in quotes.
bool needs_quotes(const std::string& text) {
  static const std::vector<std::string> special = {"null", "Null", "NULL", "none", "true", "false",
                                                   "yes",  "no",   "on",   "off",  "True", "False",
                                                   "Yes",  "No",   "On",   "Off",  "None"};
  if (text.empty() || !(std::isalpha(static_cast<unsigned char>(text[0])) || text[0] == '/'))
    return true;
  for (const char c : text)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '.' && c != '/' &&
        c != '-')
      return true;
  return std::find(special.begin(), special.end(), text) != special.end();
}

}  // namespace

namespace config_detail {

void fail_type(const ConfigNode& node, const std::string& path, const std::string& must_be) {
  throw InputError(node.place.text(),
                   in_quotes(path) + " must be " + must_be + ", got " + got(node),
                   "correct the value");
}

bool says_none(const ConfigNode& node) {
  return node.kind == Kind::null ||
         (node.kind == Kind::scalar && !node.quoted && node.text == "none");
}

void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, bool& value) {
  const bool plain = node.kind == Kind::scalar && !node.quoted;
  if (!plain || (node.text != "true" && node.text != "false"))
    fail_type(node, path, leaf_type(value, rule));
  value = node.text == "true";
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, int& value) {
  Rule narrow = rule;
  narrow.low = std::max<double>(rule.low, std::numeric_limits<int>::min());
  narrow.high = std::min<double>(rule.high, std::numeric_limits<int>::max());
  int64_t wide = 0;
  const auto parsed = parse<int64_t>(node);
  const bool too_wide = parsed && in_range(rule, static_cast<double>(*parsed));
  read_number(node, path, too_wide ? narrow : rule, wide);
  value = static_cast<int>(wide);
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, int64_t& value) {
  read_number(node, path, rule, value);
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, uint64_t& value) {
  Rule not_negative = rule;
  if (rule.low < 0) not_negative.low = 0;
  read_number(node, path, not_negative, value);
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, float& value) {
  read_number(node, path, rule, value);
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, double& value) {
  read_number(node, path, rule, value);
}
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule,
               std::string& value) {
  if (node.kind != Kind::scalar) fail_type(node, path, leaf_type(value, rule));
  const auto& choices = rule.choices;
  if (!choices.empty() && std::find(choices.begin(), choices.end(), node.text) == choices.end()) {
    const std::string close = nearest(node.text, choices);
    throw InputError(
        node.place.text(),
        in_quotes(path) + " must be " + leaf_type(value, rule) + ", got " + got(node),
        close.empty() ? "correct the value" : "did you mean " + in_quotes(close) + "?");
  }
  value = node.text;
}

ConfigNode write_leaf(bool value) { return scalar(value ? "true" : "false"); }
ConfigNode write_leaf(int value) { return scalar(shortest(value)); }
ConfigNode write_leaf(int64_t value) { return scalar(shortest(value)); }
ConfigNode write_leaf(uint64_t value) { return scalar(shortest(value)); }
ConfigNode write_leaf(float value) { return scalar(shortest(value)); }
ConfigNode write_leaf(double value) { return scalar(shortest(value)); }
ConfigNode write_leaf(const std::string& value) { return scalar(value, needs_quotes(value)); }

std::string leaf_type(bool, const Rule&) { return "true or false"; }
std::string leaf_type(int64_t, const Rule& rule) { return "a whole number" + range_text(rule); }
std::string leaf_type(double, const Rule& rule) { return "a number" + range_text(rule); }
std::string leaf_type(const std::string&, const Rule& rule) {
  return rule.choices.empty() ? "text" : "one of " + cut_list(rule.choices, kLongest);
}

}  // namespace config_detail

ConfigReader::ConfigReader(const ConfigNode& map, std::string path)
    : map_(map), path_(std::move(path)) {
  if (map.kind != Kind::map && map.kind != Kind::null)
    config_detail::fail_type(map, path_, "a section of 'key: value' lines");
}

const ConfigNode* ConfigReader::take(const std::string& key, const Rule& rule) {
  known_.push_back(key);
  const ConfigNode* node = map_.find(key);
  if (node == nullptr && rule.required) missing_.push_back(key);
  return node;
}

void ConfigReader::check(const std::string& key, bool good, const std::string& wrong,
                         const std::string& fix) const {
  if (good) return;
  const ConfigNode* node = map_.find(key);
  throw InputError((node ? *node : map_).place.text(), in_quotes(full(key)) + " " + wrong, fix);
}

void ConfigReader::finish() const {
  if (map_.kind == Kind::map) {
    for (const auto& entry : map_.children) {
      if (std::find(known_.begin(), known_.end(), entry.key) != known_.end()) continue;
      const std::string close = nearest(entry.key, known_);
      throw InputError(entry.key_place.text(), "unknown key " + in_quotes(full(entry.key)),
                       known_.empty()  ? "there are no keys here; " + path_ + "={} leaves them out"
                       : close.empty() ? "the keys here are " + cut_list(known_, kLongest)
                                       : "did you mean " + in_quotes(close) + "?");
    }
  }
  if (!missing_.empty())
    throw InputError(map_.place.text(), "the key " + in_quotes(full(missing_[0])) + " is missing",
                     "add it");
}

std::string ConfigReference::without_article(const std::string& type) {
  return type.rfind("a ", 0) == 0 ? type.substr(2) : type;
}

void ConfigReference::trim(std::string& text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  if (text == "null") text = "none";
}

void ConfigReference::add(std::string key, std::string type, std::string value, std::string doc) {
  trim(value);
  rows_.push_back({std::move(key), std::move(type), std::move(value), std::move(doc)});
}

std::string config_reference_table(const std::vector<ConfigReference::Row>& rows) {
  std::string out = "| key | type | default | meaning |\n|---|---|---|---|\n";
  const auto cell = [](std::string text) {
    for (size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2)
      text.insert(at, 1, '\\');
    return text;
  };
  for (const auto& row : rows)
    out += "| `" + row.key + "` | " + cell(row.type) + " | " +
           (row.value.empty() ? "" : "`" + cell(row.value) + "`") + " | " + cell(row.doc) + " |\n";
  return out;
}

}  // namespace restage
