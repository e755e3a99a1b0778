#include "nn/config/config.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "autograd/base/atomic_file.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// The value of `${oc.env:NAME}` or `${oc.env:NAME,DEFAULT}`, given what stands in the braces.
std::string environment(const std::string& inside, const std::string& where) {
  constexpr std::string_view kStart = "oc.env:";
  if (!inside.starts_with(kStart))
    throw InputError(
        where, "a value refers to " + in_quotes(inside) + ", and only to the environment it may",
        "write the value itself, or ${oc.env:NAME} for a variable of the environment");
  const size_t comma = std::min(inside.find(','), inside.size());
  const std::string name = inside.substr(kStart.size(), comma - kStart.size());
  const char* value = std::getenv(name.c_str());
  if (value == nullptr && comma == inside.size())
    throw InputError(where, "the environment has no variable " + in_quotes(name),
                     "set it, or write ${oc.env:NAME,DEFAULT}");
  const std::string out = value != nullptr ? value : inside.substr(comma + 1);
  if (out.find("${") != out.npos)
    throw InputError(where,
                     (value != nullptr ? "the variable " : "the default of the variable ") +
                         in_quotes(name) + " holds " + in_quotes(out) +
                         ", and a reference in a reference is not looked up",
                     "write a value without ${");
  return out;
}

/// A value with variables of the environment put in, and ~/ as the home folder.
std::string expanded(const std::string& text, const std::string& where) {
  std::string out;
  size_t at = 0;
  for (size_t start; (start = text.find("${", at)) != text.npos;) {
    const size_t end = text.find('}', start);
    if (end == text.npos)
      throw InputError(where, in_quotes(text) + " opens ${ and does not close it",
                       "write ${oc.env:NAME}");
    out += text.substr(at, start - at);
    out += environment(text.substr(start + 2, end - start - 2), where);
    at = end + 1;
  }
  out += text.substr(at);
  if (const char* home = std::getenv("HOME"); home != nullptr && out.starts_with("~/"))
    out.replace(0, 1, home);
  return out;
}

/// Reads files and their includes; knows the chain of files that are open, to see a cycle.
class Loader {
 public:
  ConfigNode load(const std::string& path) {
    std::error_code ignored;
    const fs::path canonical = fs::weakly_canonical(path, ignored);
    ConfigNode own = parse_yaml(read_file(path, kConfigMaxBytes), path);
    if (ConfigNode* python = own.find("python"))
      for (ConfigNode& file : python->children) file.text = seen_from(path, file.text);
    ConfigNode* include = own.find("include");
    if (include == nullptr) return grown(std::move(own));

    std::vector<ConfigNode> wanted;
    if (include->kind == ConfigNode::Kind::list)
      wanted = include->children;
    else
      wanted.push_back(*include);
    own.children.erase(own.children.begin() + (include - own.children.data()));

    open_.push_back(canonical);
    ConfigNode merged = own;
    merged.children.clear();
    for (const auto& item : wanted) merge_config(merged, load_included(path, item));
    merge_config(merged, std::move(own));
    open_.pop_back();
    return grown(std::move(merged));
  }

 private:
  ConfigNode load_included(const std::string& from, const ConfigNode& item) {
    const std::string where = item.place.text();
    if (item.kind != ConfigNode::Kind::scalar)
      throw InputError(where, "'include' must be a file or a list of files",
                       "write 'include: other.yaml'");
    const std::string name = expanded(item.text, where);
    const fs::path target = (fs::path(from).parent_path() / name).lexically_normal();
    std::error_code ignored;
    if (!fs::exists(target, ignored))
      throw InputError(where, "the included file " + in_quotes(name) + " does not exist",
                       "give a path relative to the file that includes it");
    if (std::find(open_.begin(), open_.end(), fs::weakly_canonical(target, ignored)) != open_.end())
      throw InputError(where, "including " + in_quotes(name) + " here makes a circle",
                       "remove one of the includes");
    if (++files_ > kConfigMaxFiles)
      throw InputError(where,
                       "more than " + std::to_string(kConfigMaxFiles) + " files are included",
                       "include fewer");
    return load(target.string());
  }

  /// Includes of includes can multiply; so the merged size is bounded too.
  static ConfigNode grown(ConfigNode node) {
    if (node.size() > kConfigMaxNodes)
      throw InputError(node.place.text(), "has too many values with its includes",
                       "include fewer files");
    return node;
  }

  std::vector<fs::path> open_;
  int files_ = 0;
};

void expand(ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::scalar) node.text = expanded(node.text, node.place.text());
  for (ConfigNode& child : node.children) expand(child);
}

}  // namespace

std::string seen_from(const std::string& file, const std::string& name) {
  if (name.empty() || name.starts_with("~/") || name.starts_with("${")) return name;
  return (fs::path(file).parent_path() / name).lexically_normal().string();
}

ConfigNode load_config_tree(const std::string& path, const std::vector<std::string>& overrides) {
  ConfigNode tree = Loader().load(path);
  for (const auto& text : overrides) apply_override(tree, text);
  expand(tree);
  return tree;
}

}  // namespace restage
