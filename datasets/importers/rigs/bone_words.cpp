#include "datasets/importers/rigs/bone_words.h"

#include <algorithm>
#include <map>
#include <set>

#include "datasets/importers/rigs/bone_dictionary.h"
#include "datasets/importers/rigs/plain_letters.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr size_t kLongestWord = 48;    // bytes; longer ones are no words of a body
constexpr size_t kLongestName = 1000;  // bytes; nobody reads more
constexpr int kMostPieces = 16;        // of decoration

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_foreign(char c) { return static_cast<unsigned char>(c) >= 0x80; }
bool is_letter(char c) { return is_upper(c) || is_lower(c) || is_foreign(c); }

/// "mixamorig:LeftUpLeg_02" -> mixamorig : Left Up Leg _ 02. Every byte is in one piece.
std::vector<std::string_view> pieces_of(std::string_view name) {
  std::vector<std::string_view> out;
  size_t begin = 0;
  for (size_t i = 1; i <= name.size(); ++i) {
    if (i < name.size()) {
      const char a = name[i - 1], b = name[i];
      const bool same =
          (is_digit(a) && is_digit(b)) || (is_foreign(a) && is_foreign(b)) ||
          (is_letter(a) && is_letter(b) && !is_foreign(a) && !is_foreign(b) &&
           !(is_lower(a) && is_upper(b)) &&
           !(is_upper(a) && is_upper(b) && i + 1 < name.size() && is_lower(name[i + 1])));
      if (same) continue;
    }
    out.push_back(name.substr(begin, i - begin));
    begin = i;
  }
  return out;
}

/// The words that `text` (lower case) is put together from, a side only at its ends; false if it is
/// not. Longer words are tried first: "upperarm" before "upper" and "arm".
bool decompose(std::string_view text, const BoneDictionary& dictionary, bool first,
               std::vector<BoneWord>& out) {
  if (text.empty()) return true;
  if (text.size() > kLongestWord) return false;
  for (size_t n = text.size(); n > 0; --n) {
    const auto at = dictionary.find(text.substr(0, n));
    if (at == dictionary.end()) continue;
    const bool whole = first && n == text.size(), outer = first || n == text.size();
    // No letter within a word is a word, and at its ends only l and r are.
    const bool side = text[0] == 'l' || text[0] == 'r';
    if (n == 1 && !whole && !(side && outer)) continue;
    out.push_back(at->second);
    if (decompose(text.substr(n), dictionary, false, out)) return true;
    out.pop_back();
  }
  return false;
}

/// "RL" is no word: sides only, and more than one.
bool is_both_sides(const std::vector<BoneWord>& words) {
  return words.size() > 1 && std::all_of(words.begin(), words.end(), [](const BoneWord& w) {
           return w.kind == BoneWordKind::left || w.kind == BoneWordKind::right;
         });
}

/// A name's words, with its numbers in their places.
struct Token {
  BoneWord word;
  bool known = true;
  long number = -1;  ///< of a token of digits
};

std::vector<Token> tokens_of(std::string_view name, const BoneDictionary& dictionary) {
  std::vector<Token> out;
  const std::vector<std::string_view> pieces = pieces_of(name);
  for (size_t i = 0; i < pieces.size();) {
    if (is_digit(pieces[i][0])) {
      out.push_back({{}, true, std::stol(std::string(pieces[i].substr(0, 9)))});
      ++i;
      continue;
    }
    if (!is_letter(pieces[i][0])) {
      ++i;
      continue;
    }
    // "Fore" and "Arm" are one word, as are "upper" and "arm" in "upper_arm": longest first.
    std::vector<size_t> ends;
    std::string joined, taken;
    for (size_t j = i; j < pieces.size() && ends.size() < 4 && !is_digit(pieces[j][0]); ++j)
      if (is_letter(pieces[j][0])) ends.push_back(j + 1);
    std::vector<BoneWord> words;
    for (; !ends.empty() && words.empty(); ends.pop_back()) {
      joined.clear();
      for (size_t j = i; j < ends.back(); ++j)
        if (is_letter(pieces[j][0])) joined += lower_case(pieces[j]);
      if (!decompose(joined, dictionary, true, words) || is_both_sides(words)) words.clear();
      if (!words.empty()) break;
    }
    for (const BoneWord& word : words) out.push_back({word, true, -1});
    if (words.empty()) out.push_back({{}, false, -1});
    i = words.empty() ? i + 1 : ends.back();
  }
  return out;
}

BonePart lower_of(BonePart part) {
  return part == BonePart::arm ? BonePart::forearm : BonePart::shin;
}

/// "arm" and "leg" with the word of height nearest before them, else after them.
BonePart with_height(const std::vector<Token>& tokens, size_t at) {
  const BonePart part = tokens[at].word.part;
  if (part != BonePart::arm && part != BonePart::leg) return part;
  BoneWordKind height = BoneWordKind::plain;
  const auto is_height = [&](size_t i) {
    return tokens[i].word.kind == BoneWordKind::upper || tokens[i].word.kind == BoneWordKind::lower;
  };
  for (size_t i = tokens.size(); i > at + 1; --i)
    if (is_height(i - 1)) height = tokens[i - 1].word.kind;
  for (size_t i = 0; i < at; ++i)
    if (is_height(i)) height = tokens[i].word.kind;
  if (height == BoneWordKind::lower) return lower_of(part);
  if (height != BoneWordKind::upper) return part;
  return part == BonePart::arm ? BonePart::upper_arm : BonePart::thigh;
}

bool is_of_leg(BonePart part) { return part >= BonePart::thigh && part <= BonePart::toe; }

/// Of a name with a word for fingers and toes: "dedos_pie" is a toe, "dedos_mano" a finger, and
/// "dedos" may be either.
void say_digit(BoneWords& words) {
  if (words.helper) return;  // a toe's control, too, is a helper
  if (is_of_leg(words.part)) {
    words.part = BonePart::toe;
    return;
  }
  words.helper = true;
  words.digit = words.part == BonePart::none;
}

// ---- decoration --------------------------------------------------------------------------------

bool is_piece(std::string_view piece) { return is_letter(piece[0]) || is_digit(piece[0]); }

/// Whether a beginning or an ending, with its separators, says which bone it is.
bool has_meaning(std::string_view part) {
  std::string letters;
  for (const std::string_view piece : pieces_of(part))
    if (is_letter(piece[0])) letters += lower_case(piece);
  std::vector<BoneWord> words;
  return decompose(letters, bone_dictionaries()[0], true, words) &&
         std::any_of(words.begin(), words.end(), [](const BoneWord& w) {
           using enum BoneWordKind;
           return w.kind == helper || w.kind == end || w.kind == digit || w.kind == left ||
                  w.kind == right;
         });
}

/// The first piece with the separators behind it, or the separators in front.
std::string first_part(const std::string& name) {
  const auto pieces = pieces_of(name);
  std::string out;
  size_t i = 0;
  if (!pieces.empty() && is_piece(pieces[0])) out = pieces[i++];
  while (i < pieces.size() && !is_piece(pieces[i])) out += pieces[i++];
  return out;
}

/// The last piece, if it consists of letters, with the separators in front of it.
std::string last_part(const std::string& name) {
  const auto pieces = pieces_of(name);
  if (pieces.empty() || is_digit(pieces.back()[0])) return "";
  std::string out(pieces.back());
  for (size_t i = pieces.size() - 1; i > 0 && !is_piece(pieces[i - 1]); --i)
    out.insert(0, pieces[i - 1]);
  return out;
}

size_t count_different(const std::vector<std::string>& names) {
  return std::set<std::string>(names.begin(), names.end()).size();
}

/// Takes off what many of the names begin (`front`) or end with; whether there was such a part.
bool drop_shared(std::vector<std::string>& names, bool front) {
  std::map<std::string, size_t> count;
  size_t all = 0;
  for (const std::string& name : names) {
    all += !name.empty();
    const std::string part = front ? first_part(name) : last_part(name);
    if (!part.empty() && part.size() < name.size()) ++count[part];
  }
  for (const auto& [part, n] : count) {
    if (n < 3 || 4 * n < 3 * all) continue;
    std::vector<std::string> out = names;
    for (std::string& name : out) {
      if (name.size() <= part.size()) continue;
      if (front && name.starts_with(part)) name.erase(0, part.size());
      if (!front && name.ends_with(part)) name.resize(name.size() - part.size());
    }
    if (has_meaning(part)) {  // "hand" and "hand_ctrl" are two bones
      if (10 * n < 9 * all || count_different(out) < count_different(names)) continue;
    }
    names = std::move(out);
    return true;
  }
  return false;
}

/// Where ".001" or "_17" begins at the end of a name; its size without.
size_t number_at(const std::string& name) {
  const size_t last = name.find_last_not_of("0123456789");
  if (last == std::string::npos || last == 0 || last + 1 == name.size()) return name.size();
  return name[last] == '_' || name[last] == '.' || name[last] == '-' ? last : name.size();
}

/// Takes off the numbers that most names end with, unless they tell bones apart ("arm_0", "arm_1").
bool drop_numbers(std::vector<std::string>& names) {
  size_t numbered = 0, all = 0;
  std::vector<std::string> out = names;
  for (std::string& name : out) {
    all += !name.empty();
    numbered += number_at(name) < name.size();
    name.resize(number_at(name));
  }
  if (numbered < 3 || 4 * numbered < 3 * all ||
      10 * count_different(out) < 9 * count_different(names))
    return false;
  names = std::move(out);
  return true;
}

/// Without the beginning of a UTF-8 character at its end: 左 and 右 share their first byte.
void drop_cut_character(std::string& text) {
  size_t lead = text.size();
  while (lead > 0 && (static_cast<unsigned char>(text[lead - 1]) & 0xC0) == 0x80) --lead;
  if (lead == 0 || !is_foreign(text[lead - 1])) return;
  const auto first = static_cast<unsigned char>(text[--lead]);
  const size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (text.size() - lead < length) text.resize(lead);
}

/// What three quarters of names begin with within a word: "mixamorig" of "mixamorighips".
std::string shared_letters(const std::vector<std::string>& names) {
  std::string out;
  size_t all = 0;
  for (const std::string& name : names) all += !name.empty();
  while (out.size() < kLongestWord) {
    std::map<char, size_t> next;
    for (const std::string& name : names)
      if (name.size() > out.size() + 1 && name.starts_with(out)) ++next[name[out.size()]];
    const auto most = std::max_element(
        next.begin(), next.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == next.end() || most->second < 4 || 4 * most->second < 3 * all) break;
    out += most->first;
  }
  drop_cut_character(out);
  return out;
}

}  // namespace

BoneWords bone_words(std::string_view name, size_t language) {
  BoneWords out;
  const std::vector<Token> tokens =
      tokens_of(plain_letters(name.substr(0, kLongestName)), bone_dictionaries()[language]);
  const bool sided = std::any_of(tokens.begin(), tokens.end(), [](const Token& token) {
    return token.word.kind == BoneWordKind::left || token.word.kind == BoneWordKind::right;
  });
  int parts = 0, strangers = 0;
  bool both = false, digit = false;
  for (size_t i = 0; i < tokens.size(); ++i) {
    const Token& token = tokens[i];
    const BoneWordKind kind = token.word.kind;
    if (token.number >= 0) {
      out.last_number = static_cast<int>(token.number);
      if (out.part != BonePart::none && out.number < 0) out.number = out.last_number;
    }
    strangers += !token.known;
    out.end |= kind == BoneWordKind::end;
    out.helper |= kind == BoneWordKind::helper || kind == BoneWordKind::end;
    digit |= kind == BoneWordKind::digit;
    const bool l = kind == BoneWordKind::l_and_part && !sided;
    if (l || kind == BoneWordKind::left || kind == BoneWordKind::right) {
      const auto side = kind == BoneWordKind::right ? BoneWords::right : BoneWords::left;
      both |= out.side != BoneWords::middle && out.side != side;
      out.side = side;
    }
    if (kind != BoneWordKind::part && kind != BoneWordKind::l_and_part) continue;
    ++parts;
    out.part = kind == BoneWordKind::part || l ? with_height(tokens, i) : lower_of(token.word.part);
    out.number = -1;
  }
  out.helper |= both;
  if (digit) say_digit(out);
  out.cost = 4 * strangers + 2 * std::max(0, parts - 1) + (out.number > 0);
  return out;
}

std::string other_side(std::string_view name) {
  std::string out;
  bool turned = false;
  for (const std::string_view piece : pieces_of(name)) {
    const std::string word = lower_case(piece);
    static const std::map<std::string, std::string, std::less<>> kOther = {
        {"left", "right"}, {"right", "left"}, {"l", "r"},   {"r", "l"},
        {"lft", "rgt"},    {"rgt", "lft"},    {"lt", "rt"}, {"rt", "lt"},
        {"lf", "rt"},      {"左", "右"},      {"右", "左"}};
    const auto at = kOther.find(word);
    turned |= at != kOther.end();
    out += at == kOther.end() ? word : at->second;
  }
  return turned ? out : "";
}

std::vector<std::string> undecorated(const std::vector<std::string>& names) {
  std::vector<std::string> out = names;
  for (std::string& name : out) {
    const size_t colon = name.find_last_of(":|");
    if (colon != std::string::npos && colon + 1 < name.size()) name.erase(0, colon + 1);
  }
  for (int i = 0; i < kMostPieces && drop_shared(out, true); ++i) continue;
  for (int i = 0; i < kMostPieces && (drop_numbers(out) || drop_shared(out, false)); ++i) continue;
  const std::string letters = shared_letters(out);
  for (std::string& name : out)
    if (name.size() > letters.size() && name.starts_with(letters)) name.erase(0, letters.size());
  return out;
}

}  // namespace restage
