#include "train/training/train_config.h"

#include <algorithm>

namespace restage {

ConfigNode of_this_version(ConfigNode left) {
  static const std::set<std::string> gone = {"root"};
  std::set<std::string> named;
  if (const ConfigNode* stages = left.find("stages"))
    for (const ConfigNode& stage : stages->children) named.insert(stage.text);
  std::erase_if(left.children, [&](const ConfigNode& section) {
    return gone.contains(section.key) && !named.contains(section.key);
  });
  return left;
}

}  // namespace restage
