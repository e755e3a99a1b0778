#include "datasets/importers/rigs/plain_letters.h"

namespace restage {
namespace {

constexpr size_t kKana = 3;  // bytes of one in UTF-8

/// A mark behind a kana of half width: "カ" and U+FF9E are "ガ", "ハ" and U+FF9F are "パ".
void voice(std::string& out, int by) {
  if (out.size() < kKana || out[out.size() - kKana] != '\xE3') return;  // behind no kana
  if (out.ends_with("ウ")) {
    out.replace(out.size() - kKana, kKana, "ヴ");
    return;
  }
  const auto last = static_cast<unsigned char>(out.back());  // its lowest six bits
  const auto next = static_cast<unsigned>(last) + static_cast<unsigned>(by);
  if (next >= 0xC0) ++out[out.size() - 2];
  out.back() = static_cast<char>(next >= 0xC0 ? next - 0x40 : next);
}

/// Adds a letter of U+FF01 to U+FF9F (ASCII of full width, kana of half width) in its common width.
/// Bytes read; 0 if the text begins with none.
int add_of_other_width(std::string_view text, std::string& out) {
  constexpr std::string_view kFullWidth =  // of U+FF65 to U+FF9D
      "・ヲァィゥェォャュョッーアイウエオカキクケコサシスセソ"
      "タチツテトナニヌネノハヒフヘホマミムメモヤユヨラリルレロワン";
  if (text.size() < 3 || text[0] != '\xEF') return 0;
  const int b = static_cast<unsigned char>(text[1]), c = static_cast<unsigned char>(text[2]);
  if (b < 0xBC || b > 0xBE || c < 0x80 || c > 0xBF) return 0;
  const int letter = ((b - 0xBC) << 6) + (c & 0x3F);  // beyond U+FF00
  if (letter >= 0x01 && letter <= 0x5E)
    out += static_cast<char>(letter + 0x20);
  else if (letter >= 0x65 && letter <= 0x9D)
    out += kFullWidth.substr(kKana * static_cast<size_t>(letter - 0x65), kKana);
  else if (letter == 0x9E || letter == 0x9F)
    voice(out, letter - 0x9D);
  else
    return 0;
  return 3;
}

}  // namespace

std::string plain_letters(std::string_view name) {
  constexpr std::string_view kLatin =  // of U+00C0 to U+00FF; '~': is none
      "AAAAAAACEEEEIIIIDNOOOOO~OUUUUYT~aaaaaaaceeeeiiiidnooooo~ouuuuyty";
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    const auto a = static_cast<unsigned char>(name[i]);
    const auto b = static_cast<unsigned char>(i + 1 < name.size() ? name[i + 1] : 0);
    if (const int width = add_of_other_width(name.substr(i), out); width > 0) {
      i += static_cast<size_t>(width) - 1;
      continue;
    }
    std::string letter(1, name[i]);
    if (const size_t at = b - size_t{0x80}; b >= 0x80 && b < 0xC0) {
      if (a == 0xC3 && b == 0x9F)
        letter = "ss";
      else if (a == 0xC3 && kLatin[at] != '~')
        letter = kLatin[at];
      else if (a == 0xD0 && b >= 0x90 && b < 0xA0)  // U+0410 to U+041F
        letter = {'\xD0', static_cast<char>(b + 0x20)};
      else if (a == 0xD0 && b >= 0xA0 && b < 0xB0)  // U+0420 to U+042F
        letter = {'\xD1', static_cast<char>(b - 0x20)};
      else if (a == 0xCC || (a == 0xCD && b < 0xB0))  // a mark above the letter before
        letter.clear();
      else
        letter += name[i + 1];
      ++i;
    }
    out += letter;
  }
  return out;
}

}  // namespace restage
