#include "datasets/readers/text/text.h"

#include <algorithm>
#include <charconv>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::text {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r'; }

}  // namespace

bool Lines::next(std::string_view& line) {
  if (rest_.empty()) return false;
  const size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  ++number_;
  return true;
}

std::string_view without_mark(std::string_view content, const std::string& path) {
  if (content.starts_with("\xFF\xFE") || content.starts_with("\xFE\xFF"))
    throw InputError(path, "is text as UTF-16", "save it as UTF-8, or as plain ASCII");
  if (content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);
  return content;
}

std::string_view take_word(std::string_view& line) {
  size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

bool parse(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc() && result.ptr == end) return true;
  const std::string lower = lower_case(word);
  // Older Windows programs write 1.#QNAN, -1.#IND00 and 1.#INF; rounded to few digits 1.#R
  // and 1.#J.
  const bool windows = lower.starts_with("1.#") || lower.starts_with("-1.#");
  // A number that no double holds is nearly zero, or beyond all bounds.
  const bool unheld = result.ec == std::errc::result_out_of_range && result.ptr == end;
  if (!windows && !unheld) return false;
  value = unheld && lower.find("e-") != std::string::npos ? 0.0
          : unheld || lower.find("inf") != std::string::npos
              ? std::numeric_limits<double>::infinity()
              : std::numeric_limits<double>::quiet_NaN();
  return true;
}
bool parse(std::string_view word, int64_t& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  return result.ec == std::errc() && result.ptr == end;
}

bool ends_in(std::string_view name, std::initializer_list<std::string_view> endings) {
  const std::string lower = lower_case(name);
  return std::any_of(endings.begin(), endings.end(),
                     [&](std::string_view ending) { return lower.ends_with(ending); });
}

size_t utf8_size(std::string_view text) {
  if (text.empty()) return 0;
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const size_t size = first >= 0xC2 && first < 0xE0   ? 2
                      : first >= 0xE0 && first < 0xF0 ? 3
                      : first >= 0xF0 && first < 0xF5 ? 4
                                                      : 0;
  if (size == 0 || text.size() < size) return 0;
  for (size_t i = 1; i < size; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool surrogate = first == 0xED && byte(1) >= 0xA0;
  const bool beyond = first == 0xF4 && byte(1) >= 0x90;
  return overlong || surrogate || beyond ? 0 : size;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const size_t size = utf8_size(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string quote(std::string_view word) {
  const std::string shown = WordLines::quoted(word);
  return cat("'", shown, shown.size() < word.size() && word.size() > 40 ? "...'" : "'");
}

bool has_decimal_comma(std::string_view word) {
  const size_t comma = word.find(',');
  double value = 0;
  if (comma == std::string_view::npos) return false;
  std::string with_point(word);
  with_point[comma] = '.';
  return comma + 1 < word.size() && parse(with_point, value);
}

void throw_no_number(std::string_view word, const std::string& where) {
  throw InputError(where, quote(word) + " is no number",
                   has_decimal_comma(word) ? "write decimals with points, not with commas"
                                           : "export the file again");
}

void throw_no_coordinate(double value, const std::string& where) {
  throw InputError(where, std::isnan(value) ? "a coordinate is NaN" : "a coordinate is infinite",
                   "restage doctor FILE --fix OUT leaves such points out");
}

}  // namespace restage::text
