// In which encoding names are that are not UTF-8.
#pragma once

#include <string>
#include <vector>

namespace restage::text {

enum class Encoding {
  shift_jis,  ///< Japanese
  latin1,     ///< Western European (ISO 8859-1 and Windows-1252)
  unsure      ///< either, or another
};

/// By the bytes beyond ASCII of all names together, those in UTF-8 left out. Shift-JIS is certain
/// where all of them are characters of Japanese, some of them kana or everyday kanji, and none
/// stands between ASCII letters as a letter with an accent does. Latin-1 is certain where all of
/// them stand so and none is such a character.
Encoding encoding_of(const std::vector<std::string>& names);

}  // namespace restage::text
