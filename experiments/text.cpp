#include "experiments/text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace restage {
namespace {

constexpr size_t kMaxLine = 398;

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

/// Characters as a terminal counts them (UTF-8, no wide ones).
size_t width(const std::string& text) {
  return text.size() -
         static_cast<size_t>(std::count_if(text.begin(), text.end(), continues_character));
}

}  // namespace

std::string valid_utf8(const std::string& text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace));
}

std::string on_one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return valid_utf8(text);
}

std::string shell_word(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string error_line(const std::string& text) {
  std::string line = on_one_line("restage: " + text);
  if (line.size() <= kMaxLine) return line;
  // Too long: shorten the middle; the place stands at the front, the fix at the end.
  constexpr size_t kTail = 200;
  size_t head = kMaxLine - kTail - 3, tail = line.size() - kTail;
  while (continues_character(line[head])) --head;
  while (tail < line.size() && continues_character(line[tail])) ++tail;
  return line.substr(0, head) + "..." + line.substr(tail);
}

std::string markdown_table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<size_t> widths;
  for (const auto& row : rows)
    for (size_t c = 0; c < row.size(); ++c) {
      if (c >= widths.size()) widths.push_back(3);
      widths[c] = std::max(widths[c], width(row[c]));
    }
  std::string text;
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t c = 0; c < rows[r].size(); ++c) {
      const std::string pad(widths[c] - width(rows[r][c]), ' ');
      text += c == 0 ? "| " + rows[r][c] + pad + " |" : " " + pad + rows[r][c] + " |";
    }
    text += "\n";
    if (r > 0) continue;
    for (size_t c = 0; c < widths.size(); ++c)
      text += c == 0 ? "|" + std::string(widths[c] + 2, '-') + "|"
                     : std::string(widths[c] + 1, '-') + ":|";
    text += "\n";
  }
  return text;
}

}  // namespace restage
