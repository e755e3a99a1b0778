#include "datasets/readers/text/encoding.h"

#include <string_view>

#include "datasets/readers/text/text.h"

namespace restage::text {
namespace {

/// What the bytes of names speak for.
struct Signs {
  size_t kanji = 0;    ///< kana, everyday kanji and punctuation of Shift-JIS: no Latin-1 letters
  size_t accents = 0;  ///< Latin-1 letters that ASCII letters surround
  bool japanese = true, latin = true;  ///< whether all of it may be that
};

int byte_at(std::string_view text, size_t i) {
  return i < text.size() ? static_cast<unsigned char>(text[i]) : 0;
}
bool is_ascii_letter(int byte) {
  return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z');
}
/// A to y with an accent, sharp s and ligatures.
bool is_latin_letter(int byte) { return byte >= 0xC0 && byte != 0xD7 && byte != 0xF7; }

/// Whether two bytes are a character of Shift-JIS (JIS X 0208) that names are written with.
bool is_kana_or_kanji(int lead, int trail) {
  if (trail < 0x40 || trail == 0x7F || trail > 0xFC) return false;
  switch (lead) {
    case 0x81:
      return trail <= 0xAC;  // punctuation, the long vowel's mark
    case 0x82:
      return (trail >= 0x4F && trail <= 0x9A) || (trail >= 0x9F && trail <= 0xF1);
    case 0x83:
      return trail <= 0x96;
    case 0x88:
      return trail >= 0x9F;
    default:
      return (lead >= 0x89 && lead <= 0x9F) || (lead >= 0xE0 && lead <= 0xE9) ||
             (lead == 0xEA && trail <= 0xA4);
  }
}

void look_as_shift_jis(std::string_view name, Signs& signs) {
  for (size_t i = 0; i < name.size(); ++i) {
    const int byte = byte_at(name, i);
    if (byte < 0x80 || (byte >= 0xA1 && byte <= 0xDF)) continue;  // ASCII, half-width kana
    if (!is_kana_or_kanji(byte, byte_at(name, i + 1))) {
      signs.japanese = false;
      return;
    }
    signs.kanji += byte < 0xA0;  // beyond that a Latin-1 letter may be meant
    ++i;
  }
}

/// A letter with an accent stands alone between ASCII letters, or at one's side.
void look_as_latin1(std::string_view name, Signs& signs) {
  for (size_t i = 0; i < name.size(); ++i) {
    const int byte = byte_at(name, i);
    if (byte < 0x80) continue;
    const int before = i == 0 ? 0 : byte_at(name, i - 1), after = byte_at(name, i + 1);
    const bool alone = before < 0x80 && after < 0x80;
    if (is_latin_letter(byte) && alone && (is_ascii_letter(before) || is_ascii_letter(after)))
      ++signs.accents;
    else
      signs.latin = false;
  }
}

}  // namespace

Encoding encoding_of(const std::vector<std::string>& names) {
  Signs signs;
  for (const std::string& name : names) {
    if (is_utf8(name)) continue;
    look_as_shift_jis(name, signs);
    look_as_latin1(name, signs);
  }
  if (signs.japanese && signs.kanji > 0 && signs.accents == 0) return Encoding::shift_jis;
  if (signs.latin && signs.accents > 0) return Encoding::latin1;
  return Encoding::unsure;
}

}  // namespace restage::text
