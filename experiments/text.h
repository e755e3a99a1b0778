// Text for people: one line of anything, tables.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "autograd/base/words.h"

namespace restage {

/// Names of files may hold any bytes: here what is not UTF-8 becomes U+FFFD.
std::string valid_utf8(const std::string& text);
/// The same; line breaks and the like become blanks.
std::string on_one_line(std::string text);
/// One word of a POSIX shell, in quotes.
std::string shell_word(const std::string& text);
/// `restage: <text>` as exactly one line of under 400 characters.
std::string error_line(const std::string& text);
/// A Markdown table with columns of equal width; the first row is the heading, the first column is
/// aligned left, the others right.
std::string markdown_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace restage
