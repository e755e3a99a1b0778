// The name of a result: the first 12 hex digits of the SHA-256 of all that determines the result.
// train/training/identity.h finds the ids of what a configuration trains.
#pragma once

#include <string>

#include "nn/config/config.h"

namespace restage {

/// Raised whenever the same configuration gives other results than before.
/// 5: a cloud's points are chosen evenly, which what extractors are asked about rests on. 4:
/// another seed draws other examples too. 3: its footing knows how the person turns. 2:
/// smrm/hybrid filters its path too, corrects in units of uncertainty and has a footing for
/// contact. 1: as of the first artifacts.
inline constexpr int kBehaviour = 5;

/// An artifact that a configuration trains.
struct StageId {
  std::string stage, id;
  std::string facts;                                     ///< what the id is the sum of, as JSON
  std::string name() const { return stage + "-" + id; }  ///< of its folder in a store
};

/// Keys and values as JSON, in the order of the keys' names. Numbers are text, so that how they are
/// printed elsewhere does not matter.
std::string keys_text(const ConfigNode& keys);
/// The first 12 hex digits of the SHA-256 of `text`.
std::string short_id(const std::string& text);

}  // namespace restage
