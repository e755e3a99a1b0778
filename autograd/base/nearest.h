// The word that somebody probably meant.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// The candidate that `word` is probably a slip of, or "": few insertions, deletions, swaps. Case
/// and '-' against '_' are no difference.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace restage
