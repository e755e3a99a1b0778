// The only place that writes to standard output and standard error.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace restage::cli {

using Json = nlohmann::ordered_json;

/// Text to standard output. WorkError if it cannot be written.
void print(const std::string& text);
/// One JSON document to standard output.
void print_json(const Json& document);
/// The one document or the text, as the user asked (Common::json).
void print(bool json, const Json& document, const std::string& text);
/// Flushes standard output. WorkError if something printed did not arrive.
void finish_output();

/// Names in files may hold line breaks and the like; here they become blanks.
std::string on_one_line(std::string text);

/// `restage: <text>` to standard error as exactly one line of under 400 characters.
void print_error(const std::string& text);
/// What print_error() prints, without the line's end.
std::string error_line(const std::string& text);

/// A Markdown table with columns of equal width; the first row is the heading, the first column is
/// aligned left, the others right.
std::string markdown_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace restage::cli
