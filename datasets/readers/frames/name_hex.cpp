// Names of frames that count in hexadecimal: frame_09, frame_0a ... frame_0f, frame_10.
#include <algorithm>
#include <map>

#include "datasets/readers/frames/name_numbers.h"

namespace restage::numbered {
namespace {

constexpr size_t kMostHexDigits = 15;  // fit 64 bits

bool is_word(char c) { return is_digit(c) || ((c | 32) >= 'a' && (c | 32) <= 'z'); }

/// Of a to f in small letters, or in capital ones (`first` is a or A).
bool is_hex_digit(char c, char first) { return is_digit(c) || (c >= first && c < first + 6); }

bool has_letter(const std::string& digits) {
  return !std::all_of(digits.begin(), digits.end(), is_digit);
}

using Template = std::pair<std::string, std::string>;  // before and behind the number
using Tokens = std::map<Template, std::vector<std::string>>;

/// All runs of hexadecimal digits that may be a number of the name: a run ends where a word ends;
/// it begins with the word, or behind letters.
void add_tokens(const std::string& name, char first, Tokens& out) {
  for (size_t word = 0; word < name.size();) {
    if (!is_word(name[word])) {
      ++word;
      continue;
    }
    size_t end = word;
    while (end < name.size() && is_word(name[end])) ++end;
    size_t digits = end;
    while (digits > word && is_hex_digit(name[digits - 1], first)) --digits;
    for (size_t at = word; at < end; ++at) {
      if (at >= digits && end - at <= kMostHexDigits)
        out[{name.substr(0, at), name.substr(end)}].push_back(name.substr(at, end - at));
      if (is_digit(name[at])) break;
    }
    word = end;
  }
}

/// Whether these count as hexadecimal numbers do.
bool count_on(const std::vector<std::string>& tokens) {
  const auto letters = static_cast<size_t>(std::count_if(tokens.begin(), tokens.end(), has_letter));
  if (tokens.size() < 3 || letters == 0 || letters == tokens.size()) return false;
  bool unequal = false, padded = false;
  std::vector<uint64_t> values;
  for (const std::string& token : tokens) {
    unequal = unequal || token.size() != tokens[0].size();
    padded = padded || (token.size() > 1 && token[0] == '0');
    values.push_back(std::stoull(token, nullptr, 16));
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if ((unequal && padded) || values.size() < 2) return false;
  uint64_t step = UINT64_MAX;
  for (size_t i = 1; i < values.size(); ++i) step = std::min(step, values[i] - values[i - 1]);
  const uint64_t places = (values.back() - values.front()) / step + 1;
  // A decimal series with one name of another kind (frame_2a) has few letters and no even steps.
  return 4 * letters < tokens.size() ? 2 * places <= 3 * values.size()
                                     : places <= 2 * values.size();
}

/// Where "0x" begins a hexadecimal number that ends a word: 0x1f, frame_0X0a, but no 640x480. npos:
/// nowhere.
size_t marked_number(const std::string& name, size_t& end) {
  for (size_t at = 0; at + 2 < name.size(); ++at) {
    if (name[at] != '0' || (name[at + 1] | 32) != 'x' || (at > 0 && is_digit(name[at - 1])))
      continue;
    end = at + 2;
    while (end < name.size() && (is_hex_digit(name[end], 'a') || is_hex_digit(name[end], 'A')))
      ++end;
    const bool word_ends = end == name.size() || !is_word(name[end]);
    if (end > at + 2 && end - at - 2 <= kMostHexDigits && word_ends) return at + 2;
  }
  return std::string::npos;
}

/// Names whose numbers say by "0x" that they are hexadecimal, if two or more do.
std::optional<Hexadecimal> marked_names(const std::vector<std::string>& names) {
  std::map<Template, size_t> count;
  for (const std::string& name : names) {
    size_t end = 0;
    const size_t at = marked_number(name, end);
    if (at != std::string::npos) ++count[{name.substr(0, at), name.substr(end)}];
  }
  const auto most = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == count.end() || most->second < 2) return std::nullopt;
  return Hexadecimal{most->first.first, most->first.second};
}

}  // namespace

std::optional<Pieces> Hexadecimal::pieces_of(const std::string& name) const {
  if (name.size() <= before.size() + behind.size() || !name.starts_with(before) ||
      !name.ends_with(behind))
    return std::nullopt;
  Piece number;
  number.text = name.substr(before.size(), name.size() - before.size() - behind.size());
  const bool hex = number.text.size() <= kMostHexDigits &&
                   std::all_of(number.text.begin(), number.text.end(),
                               [](char c) { return is_hex_digit(c, 'a') || is_hex_digit(c, 'A'); });
  if (!hex) return std::nullopt;
  number.number = true;
  number.whole = std::to_string(std::stoull(number.text, nullptr, 16));
  Pieces out{number};
  if (!before.empty()) out.insert(out.begin(), Piece{before, false, false, "", ""});
  if (!behind.empty()) out.push_back({behind, false, false, "", ""});
  return out;
}

std::optional<Hexadecimal> hexadecimal_names(const std::vector<std::string>& names) {
  if (auto marked = marked_names(names)) return marked;
  std::optional<Hexadecimal> out;
  size_t most = 0;
  for (const char first : {'a', 'A'}) {
    Tokens tokens;
    for (const std::string& name : names) add_tokens(name, first, tokens);
    for (const auto& [around, found] : tokens) {
      if (found.size() <= most || !count_on(found)) continue;
      most = found.size();
      out = Hexadecimal{around.first, around.second};
    }
  }
  return out;
}

}  // namespace restage::numbered
