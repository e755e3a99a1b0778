// The tree of values behind a configuration: what the YAML files and the command line say, each
// value with the file, line and column that it comes from. Which keys there are and what they mean
// is said by the config structs (nn/config/config_reader.h).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "autograd/base/error.h"

namespace restage {

/// Where a value was written. `line` and `column` count from 1; 0: the source has no lines.
struct ConfigPlace {
  std::string source;  ///< a file as the user named it, or "override 'key=value'"
  int line = 0, column = 0;
  std::string text() const;  ///< `file:line`
};

/// One value. Children of a map keep their order and have a `key`.
struct ConfigNode {
  enum class Kind { null, scalar, list, map };
  Kind kind = Kind::null;
  std::string key;        ///< of this entry, if the parent is a map
  ConfigPlace key_place;  ///< of the key
  ConfigPlace place;      ///< of the value
  std::string text;       ///< of a scalar
  bool quoted = false;    ///< a scalar in quotes is text, never a number
  std::vector<ConfigNode> children;

  const ConfigNode* find(std::string_view name) const;  ///< entry of a map, or nullptr
  ConfigNode* find(std::string_view name);
  size_t size() const;  ///< number of nodes, this one included
};

/// Limits of one configuration, all files and aliases together.
inline constexpr size_t kConfigMaxBytes = 1 << 20, kConfigMaxNodes = 100'000;
inline constexpr int kConfigMaxDepth = 32, kConfigMaxFiles = 64;
/// Limit of the keys of one section, since keys are looked for one by one.
inline constexpr size_t kConfigMaxKeys = 1000;

/// Parses one YAML document whose root must be a map (`any_root`: anything). Errors (InputError):
/// broken YAML, duplicate keys, tags, merge keys, more than one document, too deep or too large.
ConfigNode parse_yaml(std::string_view text, const std::string& source, bool any_root = false);

/// Lays `over` on `base`: maps are merged key by key, everything else is replaced. An empty map
/// `{}` empties the section that it is laid on; `section:` with nothing behind it changes nothing.
void merge_config(ConfigNode& base, ConfigNode over);

/// Applies `key.sub=value`; the value is YAML (`[1, 2]` is a list), list items are numbered from 0.
void apply_override(ConfigNode& root, const std::string& override_text);

/// Value at a dotted path (`stages.0.steps`), or nullptr.
const ConfigNode* find_config(const ConfigNode& root, std::string_view path);

/// An error about the value at `path`, with the place where the value was written; for checks after
/// reading (such as whether a file that a key names exists).
InputError config_error(const ConfigNode& root, std::string_view path, const std::string& wrong,
                        const std::string& fix);

/// YAML text that parse_yaml reads back to the same tree.
std::string config_to_yaml(const ConfigNode& root);

/// `text` in single quotes, unprintable characters escaped, cut to 40 characters: for messages.
std::string in_quotes(std::string_view text);

}  // namespace restage
