#include "nn/config/config.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "autograd/base/atomic_file.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Reads files and their includes; knows the chain of files that are open, to see a cycle.
class Loader {
 public:
  ConfigNode load(const std::string& path) {
    std::error_code ignored;
    const fs::path canonical = fs::weakly_canonical(path, ignored);
    ConfigNode own = parse_yaml(read_file(path, kConfigMaxBytes), path);
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
    const fs::path target = (fs::path(from).parent_path() / item.text).lexically_normal();
    std::error_code ignored;
    if (!fs::exists(target, ignored))
      throw InputError(where, "the included file " + in_quotes(item.text) + " does not exist",
                       "give a path relative to the file that includes it");
    if (std::find(open_.begin(), open_.end(), fs::weakly_canonical(target, ignored)) != open_.end())
      throw InputError(where, "including " + in_quotes(item.text) + " here makes a circle",
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

}  // namespace

ConfigNode load_config_tree(const std::string& path, const std::vector<std::string>& overrides) {
  ConfigNode tree = Loader().load(path);
  for (const auto& text : overrides) apply_override(tree, text);
  return tree;
}

}  // namespace restage
