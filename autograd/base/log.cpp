#include "autograd/base/log.h"

#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

namespace restage {
namespace {

spdlog::logger& logger() {
  static const auto instance = [] {
    auto console = std::make_shared<spdlog::sinks::stderr_sink_mt>();
    console->set_pattern("%v");
    auto made = std::make_shared<spdlog::logger>("restage", console);
    made->flush_on(spdlog::level::info);
    return made;
  }();
  return *instance;
}

}  // namespace

void set_log_level(LogLevel level) {
  static constexpr spdlog::level::level_enum levels[] = {spdlog::level::debug, spdlog::level::info,
                                                         spdlog::level::warn, spdlog::level::off};
  logger().sinks()[0]->set_level(levels[static_cast<int>(level)]);
  logger().set_level(level == LogLevel::debug ? spdlog::level::debug : spdlog::level::info);
}

void set_log_file(const std::string& path) {
  logger().sinks().resize(1);
  if (path.empty()) return;
  auto file = std::make_shared<spdlog::sinks::basic_file_sink_mt>(path, false);
  file->set_pattern("%Y-%m-%d %H:%M:%S %v");
  logger().sinks().push_back(file);
}

void log_debug(const std::string& text) { logger().debug("{}", text); }
void log_info(const std::string& text) { logger().info("{}", text); }
void log_warning(const std::string& text) { logger().warn("warning: {}", text); }

}  // namespace restage
