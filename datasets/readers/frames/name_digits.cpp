#include "datasets/readers/frames/name_digits.h"

#include <string_view>

#include "datasets/readers/frames/name_numbers.h"

namespace restage::numbered {
namespace {

/// Ten digits in UTF-8: what each begins with, and the last byte of the zero.
struct Script {
  std::string_view before;
  unsigned char zero;
};
constexpr Script kScripts[] = {
    {"\xEF\xBC", 0x90}, {"\xD9", 0xA0}, {"\xDB", 0xB0}, {"\xE0\xA5", 0xA6}};

struct WideMark {
  std::string_view wide, plain;
};
constexpr WideMark kWideMarks[] = {
    {"\xEF\xBC\x8E", "."}, {"\xEF\xBC\x8D", "-"}, {"\xE2\x88\x92", "-"}, {"\xEF\xBC\x88", "("},
    {"\xEF\xBC\x89", ")"}, {"\xE3\x80\x80", " "}, {"\xEF\xBC\xBF", "_"}};

/// What stands at the beginning of `rest`, as ASCII; moves `at` behind it.
std::string take_plain(std::string_view rest, size_t& at) {
  for (const Script& script : kScripts) {
    const size_t n = script.before.size();
    if (!rest.starts_with(script.before) || rest.size() <= n) continue;
    const int digit = static_cast<unsigned char>(rest[n]) - script.zero;
    if (digit < 0 || digit > 9) continue;
    at += n + 1;
    return std::string(1, static_cast<char>('0' + digit));
  }
  for (const WideMark& mark : kWideMarks)
    if (rest.starts_with(mark.wide)) {
      at += mark.wide.size();
      return std::string(mark.plain);
    }
  ++at;
  return std::string(1, rest[0]);
}

size_t end_of_digits(const std::string& text, size_t at) {
  while (at < text.size() && is_digit(text[at])) ++at;
  return at;
}

bool is_part_of_word(char c) { return is_digit(c) || ((c | 32) >= 'a' && (c | 32) <= 'z'); }

/// The digits of a number with the point moved by `power` places.
std::string shifted(std::string whole, std::string fraction, int power) {
  for (; power < 0; ++power) {
    fraction.insert(0, 1, whole.back());
    whole.pop_back();
    if (whole.empty()) whole = "0";
  }
  for (; power > 0; --power) {
    whole += fraction.empty() ? '0' : fraction[0];
    if (!fraction.empty()) fraction.erase(0, 1);
  }
  return fraction.empty() ? whole : whole + "." + fraction;
}

/// A number in powers of ten that begins at `at` and is a word, or empty; then `end` is behind it.
std::string decimal_at(const std::string& name, size_t at, size_t& end) {
  constexpr size_t kMostPower = 2;  // digits
  if (at > 0 && (is_part_of_word(name[at - 1]) || name[at - 1] == '.')) return "";
  size_t to = end_of_digits(name, at);
  if (to == at) return "";
  const std::string whole = name.substr(at, to - at);
  std::string fraction;
  if (to < name.size() && name[to] == '.') {
    const size_t behind = end_of_digits(name, to + 1);
    if (behind == to + 1) return "";
    fraction = name.substr(to + 1, behind - to - 1);
    to = behind;
  }
  if (to + 2 >= name.size() || (name[to] | 32) != 'e') return "";
  const char sign = name[to + 1];
  end = end_of_digits(name, to + 2);
  if ((sign != '-' && sign != '+') || end == to + 2 || end - to - 2 > kMostPower) return "";
  if (end < name.size() && is_part_of_word(name[end])) return "";
  const int power = std::stoi(name.substr(to + 2, end - to - 2));
  return shifted(whole, fraction, sign == '-' ? -power : power);
}

}  // namespace

std::string plain_numbers(const std::string& name) {
  std::string plain;
  for (size_t at = 0; at < name.size();) plain += take_plain(std::string_view(name).substr(at), at);
  std::string out;
  for (size_t at = 0; at < plain.size();) {
    size_t end = at;
    const std::string decimal = decimal_at(plain, at, end);
    out += decimal.empty() ? std::string(1, plain[at]) : decimal;
    at = decimal.empty() ? at + 1 : end;
  }
  return out;
}

}  // namespace restage::numbered
