// Typed, self-describing config structs. A struct lists its keys once, in a function found by
// argument-dependent lookup:
//
//   template <class V> void visit(V& v, SomeConfig& c) {
//     v("batch", c.batch, "examples per step", positive());
//     v.check("warmup", c.warmup <= c.steps, "is longer than the training", "lower it");
//   }
//
// Reading, the resolved YAML and the key reference all follow from this function. Values may be
// bool, int, int64_t, uint64_t, float, double, std::string, enums with a config_names(), structs
// with a visit(), and std::optional (YAML: null or none), std::vector and std::array of these. A
// visit may look at values that it has read already, to decide which keys follow.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "nn/config/config_tree.h"
#include "nn/config/rules.h"

namespace restage {

namespace config_detail {

template <class T>
struct Wrapped : std::false_type {};
template <class T>
struct Wrapped<std::optional<T>> : std::true_type {};
template <class T>
struct ListOf : std::false_type {};
template <class T>
struct ListOf<std::vector<T>> : std::true_type {};
template <class T>
struct FixedListOf : std::false_type {};
template <class T, size_t N>
struct FixedListOf<std::array<T, N>> : std::true_type {};
template <class T>
inline constexpr bool is_list = ListOf<T>::value || FixedListOf<T>::value;
template <class T>
inline constexpr bool is_leaf = std::is_arithmetic_v<T> || std::is_same_v<T, std::string>;

// Reading and writing of single values (config_reader.cpp). `path` names the key in errors.
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, bool& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, int& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, int64_t& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, uint64_t& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, float& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule, double& value);
void read_leaf(const ConfigNode& node, const std::string& path, const Rule& rule,
               std::string& value);
ConfigNode write_leaf(bool value);
ConfigNode write_leaf(int value);
ConfigNode write_leaf(int64_t value);
ConfigNode write_leaf(uint64_t value);
ConfigNode write_leaf(float value);
ConfigNode write_leaf(double value);
ConfigNode write_leaf(const std::string& value);
std::string leaf_type(bool, const Rule& rule);
std::string leaf_type(int64_t, const Rule& rule);
std::string leaf_type(double, const Rule& rule);
std::string leaf_type(const std::string&, const Rule& rule);
inline std::string leaf_type(int, const Rule& rule) { return leaf_type(int64_t{}, rule); }
inline std::string leaf_type(uint64_t, const Rule& rule) { return leaf_type(int64_t{}, rule); }
inline std::string leaf_type(float, const Rule& rule) { return leaf_type(double{}, rule); }

bool says_none(const ConfigNode& node);
[[noreturn]] void fail_type(const ConfigNode& node, const std::string& path,
                            const std::string& must_be);

template <class E>
Rule enum_rule() {
  Rule rule;
  for (const auto& entry : config_names(E{})) rule.choices.push_back(entry.first);
  return rule;
}

}  // namespace config_detail

/// Visitor that fills a struct from a map of the tree.
class ConfigReader {
 public:
  /// `path`: dotted path of `map`, "" for the root. `map` must outlive the reader.
  ConfigReader(const ConfigNode& map, std::string path);

  template <class T>
  void operator()(const std::string& key, T& value, const std::string& /*doc*/,
                  const Rule& rule = {}) {
    const ConfigNode* node = take(key, rule);
    if (node != nullptr) read(*node, full(key), rule, value);
  }
  /// Refuses values read so far unless `good`; the error stands at `key`.
  void check(const std::string& key, bool good, const std::string& wrong,
             const std::string& fix) const;
  /// Refuses keys that visit() did not ask for, then required keys that are missing.
  void finish() const;

 private:
  const ConfigNode* take(const std::string& key, const Rule& rule);
  std::string full(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  template <class T>
  static void read(const ConfigNode& node, const std::string& path, const Rule& rule, T& value) {
    namespace d = config_detail;
    if constexpr (d::is_leaf<T>) {
      d::read_leaf(node, path, rule, value);
    } else if constexpr (std::is_enum_v<T>) {
      std::string name;
      d::read_leaf(node, path, d::enum_rule<T>(), name);
      for (const auto& entry : config_names(T{}))
        if (entry.first == name) value = entry.second;
    } else if constexpr (d::Wrapped<T>::value) {
      if (d::says_none(node)) {
        value.reset();
      } else {
        if (!value) value.emplace();
        read(node, path, rule, *value);
      }
    } else if constexpr (d::FixedListOf<T>::value) {
      if (node.kind != ConfigNode::Kind::list || node.children.size() != value.size())
        d::fail_type(node, path, "a list of " + std::to_string(value.size()) + " values");
      for (size_t i = 0; i < value.size(); ++i)
        read(node.children[i], path + "." + std::to_string(i), rule, value[i]);
    } else if constexpr (d::ListOf<T>::value) {
      if (node.kind != ConfigNode::Kind::list) d::fail_type(node, path, "a list such as [a, b]");
      value.clear();
      for (size_t i = 0; i < node.children.size(); ++i) {
        typename T::value_type item{};
        read(node.children[i], path + "." + std::to_string(i), rule, item);
        value.push_back(std::move(item));
      }
    } else {
      ConfigReader inner(node, path);
      visit(inner, value);
      inner.finish();
    }
  }

  const ConfigNode& map_;
  std::string path_;
  std::vector<std::string> known_, missing_;
};

/// Fills `config` from `tree`; keys that are not given keep their values.
template <class C>
void read_config(const ConfigNode& tree, C& config, const std::string& path = "") {
  ConfigReader reader(tree, path);
  visit(reader, config);
  reader.finish();
}

/// Visitor that makes the tree of a struct's values.
class ConfigWriter {
 public:
  /// `identity`: leaves out keys that have the value that was fixed before they were added.
  explicit ConfigWriter(bool identity = false) : identity_(identity) {}

  template <class T>
  void operator()(const std::string& key, T& value, const std::string& /*doc*/,
                  const Rule& rule = {}) {
    ConfigNode node = write(value, identity_);
    if (identity_ && !rule.fixed_before.empty() && config_to_yaml(node) == rule.fixed_before + "\n")
      return;
    node.key = key;
    map.children.push_back(std::move(node));
  }
  void check(const std::string&, bool, const std::string&, const std::string&) const {}

  template <class T>
  static ConfigNode write(T& value, bool identity = false) {
    namespace d = config_detail;
    if constexpr (d::is_leaf<T>) {
      return d::write_leaf(value);
    } else if constexpr (std::is_enum_v<T>) {
      for (const auto& entry : config_names(T{}))
        if (entry.second == value) return d::write_leaf(entry.first);
      return {};
    } else if constexpr (d::Wrapped<T>::value) {
      return value ? write(*value, identity) : ConfigNode{};
    } else if constexpr (d::is_list<T>) {
      ConfigNode list;
      list.kind = ConfigNode::Kind::list;
      for (typename T::value_type item : value) list.children.push_back(write(item, identity));
      return list;
    } else {
      ConfigWriter inner(identity);
      visit(inner, value);
      return std::move(inner.map);
    }
  }

  ConfigNode map{.kind = ConfigNode::Kind::map,
                 .key = {},
                 .key_place = {},
                 .place = {},
                 .text = {},
                 .children = {}};

 private:
  bool identity_;
};

template <class C>
ConfigNode write_config(const C& config) {
  C copy = config;
  return ConfigWriter::write(copy);
}

/// What identifies a struct's values: the same tree without the keys that were added later and have
/// the value that was fixed before (added()).
template <class C>
ConfigNode write_identity(const C& config) {
  C copy = config;
  return ConfigWriter::write(copy, true);
}

/// Visitor that lists a struct's keys for the documentation.
class ConfigReference {
 public:
  struct Row {
    std::string key, type, value, doc;  ///< `value`: the default
  };
  explicit ConfigReference(std::vector<Row>& rows, std::string prefix = "")
      : rows_(rows), prefix_(std::move(prefix)) {}

  template <class T>
  void operator()(const std::string& key, T& value, const std::string& doc, const Rule& rule = {}) {
    list(prefix_ + key, value, doc, rule, "", true);
  }
  void check(const std::string&, bool, const std::string&, const std::string&) const {}

 private:
  template <class T>
  void list(const std::string& key, T& value, const std::string& doc, const Rule& rule,
            const std::string& wrap, bool show) {
    namespace d = config_detail;
    std::string shown = rule.required ? "(required)" : "";
    if (show && !rule.required) shown = config_to_yaml(ConfigWriter::write(value));
    if constexpr (d::is_leaf<T>) {
      add(key, wrap + without_article(d::leaf_type(value, rule)), shown, doc);
    } else if constexpr (std::is_enum_v<T>) {
      add(key, wrap + d::leaf_type(std::string(), d::enum_rule<T>()), shown, doc);
    } else if constexpr (d::Wrapped<T>::value || d::is_list<T>) {
      typename T::value_type inner{};
      if constexpr (d::Wrapped<T>::value)
        if (value) inner = *value;
      const size_t row = rows_.size();
      const bool wrapped = d::Wrapped<T>::value;
      list(wrapped ? key : key + "[]", inner, doc, rule, wrap + (wrapped ? "none or " : "list of "),
           false);
      rows_[row].key = key;
      rows_[row].value = shown;
      trim(rows_[row].value);
    } else {
      add(key, wrap + "section", "", doc);
      ConfigReference inner(rows_, key + ".");
      visit(inner, value);
    }
  }
  void add(std::string key, std::string type, std::string value, std::string doc);
  static std::string without_article(const std::string& type);
  static void trim(std::string& text);

  std::vector<Row>& rows_;
  std::string prefix_;
};

template <class C>
std::vector<ConfigReference::Row> config_reference(C config = {}) {
  std::vector<ConfigReference::Row> rows;
  ConfigReference reference(rows);
  visit(reference, config);
  return rows;
}
/// The rows as a Markdown table.
std::string config_reference_table(const std::vector<ConfigReference::Row>& rows);

}  // namespace restage
