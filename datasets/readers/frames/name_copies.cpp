#include "datasets/readers/frames/name_copies.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "datasets/readers/frames/name_numbers.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::numbered {
namespace {

/// The number that ends a name: "scan (2)" is "scan", " (", "2", ")".
struct Numbering {
  std::string base, open, close;
  std::string digits;
  bool padded() const { return digits.size() > 1 && digits[0] == '0'; }
  /// As Blender numbers: .001.
  bool is_blenders() const { return open == "." && digits.size() == 3; }
};

std::optional<Numbering> numbering_of(const std::string& stem) {
  Numbering out;
  size_t end = stem.size();
  if (stem.ends_with(')')) out.close = ")", --end;
  size_t at = end;
  while (at > 0 && is_digit(stem[at - 1])) --at;
  out.digits = stem.substr(at, end - at);
  if (out.digits.empty() || out.digits.size() > 9) return std::nullopt;
  for (const std::string_view open : {" (", "(", " ", "_", "-", ".", ""}) {
    const bool in_brackets = open.ends_with('(');
    if (in_brackets == out.close.empty() || !stem.substr(0, at).ends_with(open)) continue;
    out.open = open;
    out.base = stem.substr(0, at - open.size());
    return out.base.empty() ? std::nullopt : std::optional(out);
  }
  return std::nullopt;
}

constexpr std::string_view kBehind[] = {" - copy",
                                        " - kopie",
                                        " - copie",
                                        " - copia",
                                        " - c\xC3\xB3pia",
                                        " - kopia",
                                        " - kopi",
                                        " - \xE3\x82\xB3\xE3\x83\x94\xE3\x83\xBC",
                                        " - \xE5\x89\xAF\xE6\x9C\xAC",
                                        " copy",
                                        "_copy",
                                        "-copy",
                                        " kopie"};
constexpr std::string_view kBefore[] = {"copy of ", "kopie von ", "copie de ", "copia de "};

}  // namespace

std::optional<Unnumbered> unnumbered_first(const std::vector<std::string>& stems) {
  const std::set<std::string> all(stems.begin(), stems.end());
  std::map<std::string, size_t> like;  // how many names are like this one but for numbers
  for (const std::string& stem : all) ++like[pattern_of(pieces_of(stem, Meaning{}))];
  std::map<std::string, std::pair<int, std::string>> least;  // number and name, by the base
  std::optional<Unnumbered> out;
  for (const std::string& stem : all) {
    const std::optional<Numbering> n = numbering_of(stem);
    if (!n || all.count(n->base) == 0 || like[pattern_of(pieces_of(n->base, Meaning{}))] > 1)
      continue;
    const int number = std::stoi(n->digits);
    const auto [at, is_new] = least.try_emplace(n->base + n->open, number, stem);
    if (!is_new && at->second.first < number) continue;
    at->second = {number, stem};
  }
  for (const auto& [key, name] : least) {
    const Numbering n = *numbering_of(name.second);
    const bool brackets = !n.close.empty();
    const int number = name.first;
    if (number < 1 || (!brackets && number > 2) || (n.padded() && !n.is_blenders())) continue;
    const int before = !brackets && number == 2 ? 1 : 0;
    out = Unnumbered{n.base, n.base + n.open + std::to_string(before) + n.close};
  }
  return out;
}

std::optional<std::string> copied_name(const std::string& stem) {
  std::string bare = stem;
  if (const auto n = numbering_of(stem); n && (n->open == " (" || n->open == " ")) bare = n->base;
  for (const std::string& name : {stem, bare}) {
    const std::string low = lower_case(name);  // as long as `name`
    for (const std::string_view behind : kBehind)
      if (low.size() > behind.size() && low.ends_with(behind))
        return name.substr(0, name.size() - behind.size());
    for (const std::string_view before : kBefore)
      if (low.size() > before.size() && low.starts_with(before)) return name.substr(before.size());
  }
  return std::nullopt;
}

}  // namespace restage::numbered
