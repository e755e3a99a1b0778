#include "datasets/readers/text/word_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr size_t kMostWords = size_t{1} << 16;  // a line of more is no line of motion capture

void split(std::string_view line, std::vector<std::string_view>& words) {
  constexpr const char* kBlank = " \t\f\v,";
  words.clear();
  for (size_t at = line.find_first_not_of(kBlank);
       at != std::string_view::npos && words.size() <= kMostWords;) {
    const size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
}

}  // namespace

WordLines::WordLines(std::string_view text, const std::string& path)
    : text_(text::without_mark(text, path)), path_(path) {
  constexpr std::string_view kNothing("\0\x1a \t\r\n\f\v", 8);
  text_ = text_.substr(0, text_.find_last_not_of(kNothing) + 1);  // npos + 1 is 0
}

bool WordLines::next() {
  while (at_ < text_.size()) {
    size_t end = at_;
    while (end < text_.size() && text_[end] != '\n' && text_[end] != '\r') ++end;
    split(text_.substr(at_, end - at_), words_);
    at_ = end + (text_.substr(end).starts_with("\r\n") ? 2 : 1);
    ++number_;
    if (!words_.empty()) return true;
  }
  words_.clear();
  return false;
}

void WordLines::fail(const std::string& wrong, const std::string& fix) const {
  throw InputError(number_ > 0 ? cat(path_, ":", number_) : path_, wrong, fix);
}

double WordLines::number(std::string_view word) const {
  double value = 0;
  const char* end = word.data() + word.size();
  const char* begin = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
  const auto [stop, error] = std::from_chars(begin, end, value);
  const bool tiny = error == std::errc::result_out_of_range && stop == end &&
                    word.find("e-") != std::string_view::npos;
  if (tiny) return 0.0;
  if (error != std::errc() || stop != end || !std::isfinite(value) || std::abs(value) > 1e9)
    fail("'" + quoted(word) + "' is no usable number", "write a plain decimal number below 1e9");
  return value;
}

std::string WordLines::quoted(std::string_view word) {
  constexpr size_t kMost = 40;  // bytes
  std::string out;
  while (!word.empty()) {
    const size_t size = text::utf8_size(word);  // 0: no character of UTF-8
    const auto first = static_cast<unsigned char>(word[0]);
    const bool control = size == 1 && (first < 0x20 || first == 0x7f);
    const bool control1 = size == 2 && first == 0xC2 && static_cast<unsigned char>(word[1]) < 0xA0;
    const bool shown = size > 0 && !control && !control1;
    const size_t taken = std::max<size_t>(size, 1);
    if (out.size() + (shown ? taken : 1) > kMost) break;
    out += shown ? word.substr(0, taken) : "?";
    word.remove_prefix(taken);
  }
  return out;
}

bool same_word(std::string_view a, std::string_view lower_word) {
  return lower_case(a) == lower_word;
}

}  // namespace restage
