// Logging to standard error through spdlog; standard output belongs to results.
#pragma once

#include <string>

namespace restage {

enum class LogLevel { debug, info, warning, quiet };

void set_log_level(LogLevel level);
/// Also writes every line, with time, to this file (empty: no file). Appends.
void set_log_file(const std::string& path);

void log_debug(const std::string& text);
void log_info(const std::string& text);
void log_warning(const std::string& text);

}  // namespace restage
