// Lines and numbers of text formats; used by the readers of this folder.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>

#include "datasets/readers/clouds/non_finite.h"

namespace restage::text {

/// Walks over a text line by line ("\n", "\r\n"), counting from 1.
class Lines {
 public:
  explicit Lines(std::string_view content) : rest_(content) {}
  bool next(std::string_view& line);
  int64_t number() const { return number_; }       ///< of the line that next() gave
  std::string_view rest() const { return rest_; }  ///< what follows it

 private:
  std::string_view rest_;
  int64_t number_ = 0;
};

/// Without the byte order mark that some editors put before UTF-8. InputError for UTF-16.
std::string_view without_mark(std::string_view content, const std::string& path);

/// Cuts the next word off `line`; empty at its end.
std::string_view take_word(std::string_view& line);
/// The whole word as a number, independent of the locale. NaN and infinity count as numbers, in all
/// spellings (`nan`, `-nan(ind)`, `inf`, `1.#QNAN`, `-1.#IND`).
bool parse(std::string_view word, double& value);
bool parse(std::string_view word, int64_t& value);
/// Whether the name ends in one of these (lower case), whatever its own case is.
bool ends_in(std::string_view name, std::initializer_list<std::string_view> endings);
/// Bytes of the character that the text begins with; 0 if that is none of UTF-8.
size_t utf8_size(std::string_view text);
bool is_utf8(std::string_view text);
/// A short, printable copy for messages.
std::string quote(std::string_view word);

/// Whether it is a number whose decimals begin with a comma: "0,5".
bool has_decimal_comma(std::string_view word);
/// InputError for a word where a number belongs.
[[noreturn]] void throw_no_number(std::string_view word, const std::string& where);
[[noreturn]] void throw_no_coordinate(double value, const std::string& where);
/// One coordinate as float; if it is NaN, infinite or beyond float, NaN or InputError at `where()`.
template <class Where>
float coordinate(double value, const Where& where, NonFinite how = NonFinite::refuse) {
  if (!(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))) {
    if (how == NonFinite::mark) return std::numeric_limits<float>::quiet_NaN();
    throw_no_coordinate(value, where());
  }
  return static_cast<float>(value);
}
/// Adds the fan of a polygon of n corners.
template <class Index>
void add_fan(const Index& corner, size_t n, std::vector<Triangle>& faces) {
  for (size_t i = 2; i < n; ++i) faces.push_back({corner[0], corner[i - 1], corner[i]});
}

}  // namespace restage::text
