// Logging to standard error through spdlog; standard output belongs to results.
#pragma once

#include <string>

namespace restage {

enum class LogLevel { debug, info, warning, quiet };

void set_log_level(LogLevel level);
/// From now on appends every line, with its time, to this file, too (empty: to no file).
void set_log_file(const std::string& path);

void log_debug(const std::string& text);
void log_info(const std::string& text);
void log_warning(const std::string& text);

}  // namespace restage
