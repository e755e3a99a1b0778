// Files of other kinds: what they are, and what makes one of ours of them.
#pragma once

#include <string>

namespace restage {

/// InputError for a file that is known, by its name, to be of a kind that is not read where clouds
/// and meshes are, with the way to convert it. Returns for all others.
void refuse_foreign_kind(const std::string& path);

}  // namespace restage
