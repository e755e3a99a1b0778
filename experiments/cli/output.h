// The only place that writes to standard output and standard error.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "experiments/text.h"

namespace restage::cli {

using Json = nlohmann::ordered_json;

/// While it lives, what this thread prints is kept in `text` and goes nowhere else: for callers
/// that are no command line (python/).
class Captured {
 public:
  Captured();
  ~Captured();
  Captured(const Captured&) = delete;
  Captured& operator=(const Captured&) = delete;
  std::string text;

 private:
  Captured* before_;
};

/// Text to standard output. WorkError if it cannot be written.
void print(const std::string& text);
/// One JSON document to standard output.
void print_json(const Json& document);
/// The one document or the text, as the user asked (Common::json).
void print(bool json, const Json& document, const std::string& text);
/// Flushes standard output. WorkError if something printed did not arrive.
void finish_output();

/// error_line() (experiments/text.h) to standard error.
void print_error(const std::string& text);

}  // namespace restage::cli
