// The word that somebody probably meant.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// The candidate that `word` is probably a slip of, or "": few insertions, deletions, swaps. Upper
/// and lower case, and '-' and '_', count as equal.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace restage
