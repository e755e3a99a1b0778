// What lies below a folder. Links are followed, each folder is visited once, hidden ones are left
// out; everything comes in natural order (natural_less).
#pragma once

#include <string>
#include <vector>

namespace restage {

/// `root` itself first.
std::vector<std::string> folders_below(const std::string& root);
/// Regular files whose name `wanted` accepts; all of them otherwise.
std::vector<std::string> files_below(
    const std::string& root,
    bool (*wanted)(const std::string&) = [](const std::string&) { return true; });

/// Whether a name is a path to a file below a folder, in its shortest form.
bool is_inside(const std::string& name);

}  // namespace restage
