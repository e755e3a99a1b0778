#include "datasets/importers/rigs/finger_bones.h"

#include <algorithm>

#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr int kFingers = 5, kLength = 3;

/// What fingers are called, thumb to little finger.
const std::vector<std::string> kFingerNames[kFingers] = {
    {"thumb", "親指"},
    {"index", "pointer", "人指", "人差"},
    {"middle", "中指"},
    {"ring", "薬指"},
    {"pinky", "pinkie", "little", "small", "小指"}};

bool holds(const std::string& name, const std::string& word) {
  return name.find(word) != std::string::npos;
}

bool is_small_letter(char c) { return c >= 'a' && c <= 'z'; }

/// Whether a word of the name is `word`: "LeftHandRing1" and "f_ring.01" are rings, "Earring" is
/// none. Words begin at capitals, too.
bool says(const std::string& name, const std::string& word) {
  const std::string lower = lower_case(name);
  for (size_t at = lower.find(word); at != std::string::npos; at = lower.find(word, at + 1)) {
    const size_t end = at + word.size();
    const bool begins = at <= 1 || !is_small_letter(lower[at - 1]) || (name[at] != lower[at]) ||
                        lower.substr(0, at).ends_with("hand");
    const bool ends = end == name.size() || !is_small_letter(name[end]);
    if (begins && (ends || lower.substr(end).starts_with("proximal") ||
                   lower.substr(end).starts_with("finger")))
      return true;
  }
  return false;
}

/// The number behind "finger": its first digit; -1: none.
int number_of_finger(const std::string& name) {
  const std::string word = "finger";
  size_t at = name.find(word);
  if (at == std::string::npos) return -1;
  at += word.size();
  if (at < name.size() && (name[at] == '_' || name[at] == '.' || name[at] == ' ')) ++at;
  return at < name.size() && name[at] >= '0' && name[at] <= '9' ? name[at] - '0' : -1;
}

/// Which finger a bone is of; -1: of none. `first`: the thumb's number.
int finger_of(const std::string& name, int first) {
  const std::string lower = lower_case(name);
  for (const char* helper : {"twist", "roll", "nub", "helper", "sword", "weapon"})
    if (holds(lower, helper)) return -1;
  for (int f = 0; f < kFingers; ++f)
    for (const std::string& word : kFingerNames[f])
      if (static_cast<unsigned char>(word[0]) >= 128 ? holds(name, word) : says(name, word))
        return f == 0 || !holds(lower, "metacarp") ? f : -1;
  const int number = number_of_finger(lower);
  return number >= first && number < first + kFingers ? number - first : -1;
}

}  // namespace

FingerBones find_fingers(const std::vector<std::string>& names, const std::vector<int>& parents,
                         const std::array<int, 2>& hands) {
  FingerBones out;
  out.fill(-1);
  for (int side = 0; side < 2; ++side) {
    std::vector<bool> below(names.size());
    below[static_cast<size_t>(hands[static_cast<size_t>(side)])] = true;
    int first = 1;
    std::vector<size_t> bones;
    for (size_t b = 0; b < names.size(); ++b) {
      if (parents[b] < 0 || !below[static_cast<size_t>(parents[b])]) continue;
      below[b] = true;
      bones.push_back(b);
      if (number_of_finger(lower_case(names[b])) == 0) first = 0;
    }
    for (const size_t b : bones) {
      const int finger = finger_of(names[b], first);
      if (finger < 0) continue;
      // The first of a finger, or the one that hangs on what was found last.
      int* const chain = &out[static_cast<size_t>(finger_bone(side, finger, 0))];
      const int length = static_cast<int>(std::find(chain, chain + kLength, -1) - chain);
      if (length < kLength && (length == 0 || chain[length - 1] == parents[b]))
        chain[length] = static_cast<int>(b);
    }
  }
  return out;
}

}  // namespace restage
