#include "datasets/importers/bone_words.h"

#include <algorithm>
#include <map>

#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

constexpr size_t kLongestWord = 48;    // bytes; longer ones are no words of a body
constexpr size_t kLongestName = 1000;  // bytes; nobody reads more
constexpr int kMostPieces = 16;        // of decoration

enum class Kind : uint8_t { plain, part, left, right, upper, lower, helper };
struct Word {
  Kind kind = Kind::plain;  ///< plain: says nothing
  BonePart part = BonePart::none;
};

using Dictionary = std::map<std::string, Word, std::less<>>;

void add(Dictionary& out, Word word, std::string_view words) {
  while (!words.empty()) {
    const size_t end = std::min(words.find(' '), words.size());
    out[std::string(words.substr(0, end))] = word;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
}

const Dictionary& dictionary() {
  static const Dictionary words = [] {
    Dictionary out;
    const auto part = [&](BonePart is, std::string_view text) { add(out, {Kind::part, is}, text); };
    const auto kind = [&](Kind is, std::string_view text) { add(out, {is, BonePart::none}, text); };
    part(BonePart::pelvis, "pelvis pelvic lowerbody 下半身");
    part(BonePart::hip, "hip hips");
    part(BonePart::spine,
         "spine chest torso trunk abdomen abs ab waist back thorax rib ribs ribcage lumbar belly "
         "stomach sternum vertebra upperback lowerback upperbody 上半身");
    part(BonePart::neck, "neck 首");
    part(BonePart::head, "head 頭");
    part(BonePart::collar, "clavicle collar collarbone clav scapula 肩");
    part(BonePart::shoulder, "shoulder shldr");
    part(BonePart::upper_arm, "upperarm uparm uarm humerus bicep biceps 腕");
    part(BonePart::arm, "arm");
    part(BonePart::forearm, "forearm farm elbow radius ulna ひじ 肘");
    part(BonePart::hand, "hand wrist 手首");
    part(BonePart::palm, "palm fist 手");
    part(BonePart::thigh, "thigh upleg femur 足");
    part(BonePart::leg, "leg");
    part(BonePart::shin, "shin calf knee shank tibia crus ひざ 膝");
    part(BonePart::ankle, "ankle 足首");
    part(BonePart::foot, "foot");
    part(BonePart::toe, "toe toes toebase ball つま先");
    kind(Kind::left, "left l lft lt 左");
    kind(Kind::right, "right r rgt rt 右");
    kind(Kind::upper, "upper up");
    kind(Kind::lower, "lower low lo fore");
    kind(Kind::plain,
         "bone bones joint joints jnt jt bn bind skin def deform drv rig armature skeleton base "
         "bend stretch main c m x center centre mid");
    kind(Kind::helper,
         "twist roll ik fk pole ctrl ctl control controller con target goal end nub tip top eff "
         "effector site aux corrective helper muscle volume jiggle dyn phys sec adj mch org vis "
         "tweak gizmo locator socket attach prop weapon sword gun shield slot camera pivot reverse "
         "heel hook parent space switch dummy grp group offset zero null auto sdk part "
         "thumb index middle ring pinky pinkie little finger fingers metacarpal metacarpals carpal "
         "metatarsal metatarsals phalanx knuckle bigtoe indextoe middletoe ringtoe littletoe "
         "eye eyes eyelid brow eyebrow jaw tongue teeth tooth lip lips cheek nose ear hair beard "
         "mouth chin face facial pony ponytail hat helmet bangs "
         "breast bust boob butt buttock glute pec skirt cape cloth tail wing cloak coat scarf "
         "strap pad armor armour pauldron belt bag quiver holster "
         "捩 捩れ 補助 キャンセル 親指 人指 中指 薬指 小指 ｉｋ 先 指");
    return out;
  }();
  return words;
}

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
bool decompose(std::string_view text, bool first, std::vector<Word>& out) {
  if (text.empty()) return true;
  if (text.size() > kLongestWord) return false;
  for (size_t n = text.size(); n > 0; --n) {
    const auto at = dictionary().find(text.substr(0, n));
    if (at == dictionary().end()) continue;
    const bool side = at->second.kind == Kind::left || at->second.kind == Kind::right;
    const bool whole = first && n == text.size(), outer = first || n == text.size();
    if (n == 1 && !whole && !(side && outer)) continue;  // no letter within a word is a word
    out.push_back(at->second);
    if (decompose(text.substr(n), false, out)) return true;
    out.pop_back();
  }
  return false;
}

/// "RL" is no word: sides only, and more than one.
bool is_both_sides(const std::vector<Word>& words) {
  return words.size() > 1 && std::all_of(words.begin(), words.end(), [](const Word& w) {
           return w.kind == Kind::left || w.kind == Kind::right;
         });
}

/// A name's words, with its numbers in their places.
struct Token {
  Word word;
  bool known = true;
  long number = -1;  ///< of a token of digits
};

std::vector<Token> tokens_of(std::string_view name) {
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
    std::vector<Word> words;
    for (; !ends.empty() && words.empty(); ends.pop_back()) {
      joined.clear();
      for (size_t j = i; j < ends.back(); ++j)
        if (is_letter(pieces[j][0])) joined += lower_case(pieces[j]);
      if (!decompose(joined, true, words) || is_both_sides(words)) words.clear();
      if (!words.empty()) break;
    }
    for (const Word& word : words) out.push_back({word, true, -1});
    if (words.empty()) out.push_back({{}, false, -1});
    i = words.empty() ? i + 1 : ends.back();
  }
  return out;
}

/// "arm" and "leg" with the word of height nearest before them, else after them.
BonePart with_height(const std::vector<Token>& tokens, size_t at) {
  const BonePart part = tokens[at].word.part;
  if (part != BonePart::arm && part != BonePart::leg) return part;
  Kind height = Kind::plain;
  const auto is_height = [&](size_t i) {
    return tokens[i].word.kind == Kind::upper || tokens[i].word.kind == Kind::lower;
  };
  for (size_t i = tokens.size(); i > at + 1; --i)
    if (is_height(i - 1)) height = tokens[i - 1].word.kind;
  for (size_t i = 0; i < at; ++i)
    if (is_height(i)) height = tokens[i].word.kind;
  if (height == Kind::upper) return part == BonePart::arm ? BonePart::upper_arm : BonePart::thigh;
  if (height == Kind::lower) return part == BonePart::arm ? BonePart::forearm : BonePart::shin;
  return part;
}

// ---- decoration --------------------------------------------------------------------------------

/// Whether a beginning or an ending says which bone it is.
bool has_meaning(std::string_view piece) {
  std::vector<Word> words;
  return decompose(lower_case(piece), true, words) &&
         std::any_of(words.begin(), words.end(), [](const Word& w) {
           return w.kind == Kind::helper || w.kind == Kind::left || w.kind == Kind::right;
         });
}

/// What part_of() gives of three quarters of the names, if it leaves something of them; "" if they
/// share nothing.
template <class PartOf>
std::string shared(const std::vector<std::string>& names, const PartOf& part_of) {
  std::map<std::string, size_t> count;
  size_t all = 0;
  for (const std::string& name : names) {
    all += !name.empty();
    if (const std::string part = part_of(name); !part.empty() && part.size() < name.size())
      ++count[part];
  }
  for (const auto& [part, n] : count)
    if (n >= 3 && 4 * n >= 3 * all) return part;
  return "";
}

/// The first piece with the separators behind it, or the separators in front.
std::string first_part(const std::string& name) {
  const auto pieces = pieces_of(name);
  std::string out;
  size_t i = 0;
  if (!pieces.empty() && (is_letter(pieces[0][0]) || is_digit(pieces[0][0]))) {
    if (has_meaning(pieces[0])) return "";
    out = pieces[i++];
  }
  while (i < pieces.size() && !is_letter(pieces[i][0]) && !is_digit(pieces[i][0]))
    out += pieces[i++];
  return out;
}

/// The last piece, if it consists of letters, with the separators in front of it.
std::string last_part(const std::string& name) {
  const auto pieces = pieces_of(name);
  if (pieces.empty() || is_digit(pieces.back()[0]) || has_meaning(pieces.back())) return "";
  std::string out(pieces.back());
  for (size_t i = pieces.size() - 1; i > 0; --i) {
    if (is_letter(pieces[i - 1][0]) || is_digit(pieces[i - 1][0])) break;
    out.insert(0, pieces[i - 1]);
  }
  return out;
}

/// Where ".001" or "_17" begins at the end of a name; its size without.
size_t number_at(const std::string& name) {
  const size_t last = name.find_last_not_of("0123456789");
  if (last == std::string::npos || last == 0 || last + 1 == name.size()) return name.size();
  return name[last] == '_' || name[last] == '.' || name[last] == '-' ? last : name.size();
}

bool drop_numbers(std::vector<std::string>& names) {
  size_t numbered = 0, all = 0;
  for (const std::string& name : names) {
    all += !name.empty();
    numbered += number_at(name) < name.size();
  }
  if (numbered < 3 || 4 * numbered < 3 * all) return false;
  for (std::string& name : names) name.resize(number_at(name));
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

BoneWords bone_words(std::string_view name) {
  BoneWords out;
  const std::vector<Token> tokens = tokens_of(name.substr(0, kLongestName));
  int parts = 0, strangers = 0;
  bool both = false;
  for (size_t i = 0; i < tokens.size(); ++i) {
    const Token& token = tokens[i];
    if (token.number >= 0 && out.part != BonePart::none && out.number < 0)
      out.number = static_cast<int>(token.number);
    strangers += !token.known;
    const Kind kind = token.word.kind;
    out.helper |= kind == Kind::helper;
    if (kind == Kind::left || kind == Kind::right) {
      const auto side = kind == Kind::left ? BoneWords::left : BoneWords::right;
      both |= out.side != BoneWords::middle && out.side != side;
      out.side = side;
    }
    if (kind != Kind::part) continue;
    ++parts;
    out.part = with_height(tokens, i);
    out.number = -1;
  }
  out.helper |= both;
  out.cost = 4 * strangers + 2 * std::max(0, parts - 1) + (out.number > 0);
  return out;
}

std::string other_side(std::string_view name) {
  std::string out;
  bool turned = false;
  for (const std::string_view piece : pieces_of(name)) {
    const std::string word = lower_case(piece);
    static const std::map<std::string, std::string, std::less<>> kOther = {
        {"left", "right"}, {"right", "left"}, {"l", "r"},   {"r", "l"},   {"lft", "rgt"},
        {"rgt", "lft"},    {"lt", "rt"},      {"rt", "lt"}, {"左", "右"}, {"右", "左"}};
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
  const auto drop_first = [&](const std::string& beginning) {
    for (std::string& name : out)
      if (name.size() > beginning.size() && name.starts_with(beginning))
        name.erase(0, beginning.size());
    return !beginning.empty();
  };
  const auto drop_last = [&](const std::string& ending) {
    for (std::string& name : out)
      if (name.size() > ending.size() && name.ends_with(ending))
        name.resize(name.size() - ending.size());
    return !ending.empty();
  };
  for (int i = 0; i < kMostPieces && drop_first(shared(out, first_part)); ++i) continue;
  for (int i = 0; i < kMostPieces && (drop_numbers(out) || drop_last(shared(out, last_part))); ++i)
    continue;
  drop_first(shared_letters(out));
  return out;
}

}  // namespace restage
