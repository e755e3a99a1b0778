#include "autograd/base/log.h"

#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

namespace restage {
namespace {

/// The logger with its two sinks, which never change: other threads may be writing.
struct Log {
  std::shared_ptr<spdlog::sinks::stderr_sink_mt> console =
      std::make_shared<spdlog::sinks::stderr_sink_mt>();
  std::shared_ptr<spdlog::sinks::dist_sink_mt> files =  // none or one; it has a lock of its own
      std::make_shared<spdlog::sinks::dist_sink_mt>();
  spdlog::logger logger{"restage", {console, files}};
  Log() {
    console->set_pattern("%v");
    logger.flush_on(spdlog::level::info);
  }
};

Log& the_log() {
  static Log instance;
  return instance;
}

}  // namespace

void set_log_level(LogLevel level) {
  static constexpr spdlog::level::level_enum levels[] = {spdlog::level::debug, spdlog::level::info,
                                                         spdlog::level::warn, spdlog::level::off};
  the_log().console->set_level(levels[static_cast<int>(level)]);
  the_log().logger.set_level(level == LogLevel::debug ? spdlog::level::debug : spdlog::level::info);
}

void set_log_file(const std::string& path) {
  the_log().files->set_sinks({});
  if (path.empty()) return;
  auto file = std::make_shared<spdlog::sinks::basic_file_sink_mt>(path, false);
  file->set_pattern("%Y-%m-%d %H:%M:%S %v");
  the_log().files->add_sink(file);
}

void log_debug(const std::string& text) { the_log().logger.debug("{}", text); }
void log_info(const std::string& text) { the_log().logger.info("{}", text); }
void log_warning(const std::string& text) { the_log().logger.warn("warning: {}", text); }

}  // namespace restage
