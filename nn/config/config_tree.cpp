#include "nn/config/config_tree.h"

#include <cctype>
#include <charconv>
#include <utility>

#include "autograd/base/format.h"

namespace restage {
namespace {

bool plain_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '/' ||
         c == '-';
}

/// Escapes what would break a line of a message or a double-quoted YAML scalar.
std::string escaped(std::string_view text, bool yaml) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (yaml && (c == '"' || c == '\\')) {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      out += format("\\x%02x", byte);
    } else {
      out += c;
    }
  }
  return out;
}

std::string scalar_text(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::null) return "null";
  if (!node.quoted) return node.text;
  return '"' + escaped(node.text, true) + '"';
}

std::string key_text(const std::string& key) {
  bool plain = !key.empty() && (std::isalpha(static_cast<unsigned char>(key[0])) || key[0] == '_');
  for (const char c : key) plain = plain && plain_character(c);
  if (key == "null" || key == "Null" || key == "NULL") plain = false;
  return plain ? key : '"' + escaped(key, true) + '"';
}

bool holds_map(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::map) return true;
  for (const auto& child : node.children)
    if (holds_map(child)) return true;
  return false;
}

/// A value on one line.
std::string flow(const ConfigNode& node) {
  const bool map = node.kind == ConfigNode::Kind::map;
  if (!map && node.kind != ConfigNode::Kind::list) return scalar_text(node);
  std::string out = map ? "{" : "[";
  for (size_t i = 0; i < node.children.size(); ++i) {
    if (i > 0) out += ", ";
    if (map) out += key_text(node.children[i].key) + ": ";
    out += flow(node.children[i]);
  }
  return out + (map ? "}" : "]");
}

void write_map(const ConfigNode& map, const std::string& indent, bool first_inline,
               std::string& out) {
  for (const auto& entry : map.children) {
    if (!first_inline) out += indent;
    first_inline = false;
    out += key_text(entry.key) + ":";
    if (entry.children.empty() || !holds_map(entry)) {
      out += " " + flow(entry) + "\n";
    } else if (entry.kind == ConfigNode::Kind::map) {
      out += "\n";
      write_map(entry, indent + "  ", false, out);
    } else {
      out += "\n";
      for (const auto& item : entry.children) {
        out += indent + "  - ";
        if (item.kind == ConfigNode::Kind::map && !item.children.empty())
          write_map(item, indent + "    ", true, out);
        else
          out += flow(item) + "\n";
      }
    }
  }
}

/// The child that one part of a dotted path names, or nullptr.
const ConfigNode* step_into(const ConfigNode& node, std::string_view part) {
  if (node.kind == ConfigNode::Kind::map) return node.find(part);
  size_t index = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
  const bool number = error == std::errc() && end == part.data() + part.size();
  if (node.kind != ConfigNode::Kind::list || !number || index >= node.children.size())
    return nullptr;
  return &node.children[index];
}

/// "a.b.c" to {"a", "b", "c"}.
std::vector<std::string> parts_of(std::string_view path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

void set_place(ConfigNode& node, const ConfigPlace& place) {
  node.place = node.key_place = place;
  for (auto& child : node.children) set_place(child, place);
}

}  // namespace

std::string ConfigPlace::text() const {
  return line > 0 ? source + ":" + std::to_string(line) : source;
}

const ConfigNode* ConfigNode::find(std::string_view name) const {
  if (kind == Kind::map)
    for (const auto& child : children)
      if (child.key == name) return &child;
  return nullptr;
}

ConfigNode* ConfigNode::find(std::string_view name) {
  return const_cast<ConfigNode*>(std::as_const(*this).find(name));
}

size_t ConfigNode::size() const {
  size_t total = 1;
  for (const auto& child : children) total += child.size();
  return total;
}

void merge_config(ConfigNode& base, ConfigNode over) {
  // `section:` with nothing below it changes nothing.
  if (base.kind == ConfigNode::Kind::map && over.kind == ConfigNode::Kind::null) return;
  if (base.kind != ConfigNode::Kind::map || over.kind != ConfigNode::Kind::map) {
    std::string key = std::move(base.key);
    base = std::move(over);
    base.key = std::move(key);
    return;
  }
  // `section: {}`; a file that only includes others is no such section.
  if (over.children.empty() && !base.key.empty()) base.children.clear();
  for (auto& entry : over.children) {
    if (ConfigNode* old = base.find(entry.key))
      merge_config(*old, std::move(entry));
    else
      base.children.push_back(std::move(entry));
  }
}

void apply_override(ConfigNode& root, const std::string& override_text) {
  const size_t equals = override_text.find('=');
  const auto parts = parts_of(std::string_view(override_text).substr(0, equals));
  bool good = equals != std::string::npos && parts.size() <= static_cast<size_t>(kConfigMaxDepth);
  for (const auto& part : parts) {
    good = good && !part.empty();
    for (const char c : part) good = good && plain_character(c) && c != '/';
  }
  if (!good)
    throw InputError("", in_quotes(override_text) + " is no override",
                     "write key=value or key.sub=value");
  const ConfigPlace place{"override " + in_quotes(override_text), 0, 0};
  if (override_text.size() > kConfigMaxBytes)
    throw InputError(place.source, "is too long", "put the value into a file and include it");
  ConfigNode value =
      parse_yaml(std::string_view(override_text).substr(equals + 1), place.source, true);
  set_place(value, place);

  ConfigNode* node = &root;
  for (const auto& part : parts) {
    if (const ConfigNode* child = step_into(*node, part)) {
      node = const_cast<ConfigNode*>(child);
      continue;
    }
    if (node->kind == ConfigNode::Kind::list)
      throw InputError(place.source, "the list has no item " + in_quotes(part),
                       "give a number from 0 to " + std::to_string(node->children.size() - 1));
    // A scalar has no children; the reader will say what belongs there.
    if (node->kind != ConfigNode::Kind::map) {
      node->kind = ConfigNode::Kind::map;
      node->place = place;
    }
    ConfigNode fresh;
    fresh.key = part;
    fresh.place = fresh.key_place = place;
    node->children.push_back(std::move(fresh));
    node = &node->children.back();
  }
  merge_config(*node, std::move(value));
}

const ConfigNode* find_config(const ConfigNode& root, std::string_view path) {
  const ConfigNode* node = &root;
  for (const auto& part : parts_of(path))
    if (node != nullptr) node = step_into(*node, part);
  return node;
}

InputError config_error(const ConfigNode& root, std::string_view path, const std::string& wrong,
                        const std::string& fix) {
  const ConfigNode* node = find_config(root, path);
  return InputError((node ? *node : root).place.text(), in_quotes(path) + " " + wrong, fix);
}

std::string config_to_yaml(const ConfigNode& root) {
  if (root.kind != ConfigNode::Kind::map || root.children.empty()) return flow(root) + "\n";
  std::string out;
  write_map(root, "", false, out);
  return out;
}

std::string in_quotes(std::string_view text) {
  constexpr size_t kMost = 40;
  if (text.size() <= kMost) return "'" + escaped(text, false) + "'";
  size_t cut = kMost - 3;  // never inside a UTF-8 character
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80) --cut;
  return "'" + escaped(text.substr(0, cut), false) + "...'";
}

}  // namespace restage
