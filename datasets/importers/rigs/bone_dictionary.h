// The words that names of bones are made of, in the languages of those who name them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "datasets/importers/rigs/bone_words.h"

namespace restage {

enum class BoneWordKind : uint8_t {
  plain,  ///< says nothing
  part,
  left,
  right,
  upper,
  lower,
  helper,
  end,        ///< a helper, too: what lies at the end of a bone
  digit,      ///< a finger or a toe
  l_and_part  ///< "larm": left, or, where another word says the side, lower
};

/// A word of a name.
struct BoneWord {
  BoneWordKind kind = BoneWordKind::plain;
  BonePart part = BonePart::none;
};

/// Words in lower case and without accents.
using BoneDictionary = std::map<std::string, BoneWord, std::less<>>;

/// The first one is English and what MikuMikuDance calls its bones; the
/// others add a language each to the English words, which people mix with their own.
const std::vector<BoneDictionary>& bone_dictionaries();

}  // namespace restage
