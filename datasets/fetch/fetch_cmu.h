// CMU's recordings from the repositories that publish them.
#pragma once

#include <string>

#include "datasets/importers/motions/cmu_pack.h"

namespace restage {

/// Brings every recording and skeleton of the list into `folder`/NAME/PATH, whichever repositories
/// have them, each checked against the sum that git knows it by; what is there and right is left
/// alone. WorkError: the network or the disk fails, what arrives is not what is listed, or no
/// repository has a file (which).
void fetch_cmu_originals(const CmuOriginals& originals, const std::string& folder);

/// Whether every one of them lies somewhere below `folder`.
bool has_cmu_originals(const CmuOriginals& originals, const std::string& folder);

}  // namespace restage
