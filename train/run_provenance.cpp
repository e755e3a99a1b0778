#include "train/run_provenance.h"

#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "autograd/kernels/instruction_sets.h"

// The build gives these for this file; without them the answer is "unknown".
#ifndef RESTAGE_VERSION
#define RESTAGE_VERSION "unknown"
#endif
#ifndef RESTAGE_GIT_COMMIT
#define RESTAGE_GIT_COMMIT "unknown"
#endif
#ifndef RESTAGE_FLAGS
#define RESTAGE_FLAGS "unknown"
#endif

namespace restage {
namespace {

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "gcc " __VERSION__;
#else
  return "unknown";
#endif
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  return "unknown";
}

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace

std::string provenance_json(const RunInput& input) {
  nlohmann::ordered_json json = {{"version", RESTAGE_VERSION},
                                 {"git_commit", RESTAGE_GIT_COMMIT},
                                 {"compiler", compiler()},
                                 {"flags", RESTAGE_FLAGS},
                                 {"processor", processor()},
                                 {"cores", std::thread::hardware_concurrency()},
                                 {"simd", instruction_set()},
                                 {"threads", input.threads},
                                 {"seed", input.seed},
                                 {"data", nlohmann::ordered_json::array()},
                                 {"command_line", input.command_line},
                                 {"started", now_utc()}};
  for (const auto& file : input.data)
    json["data"].push_back(
        nlohmann::ordered_json{{"path", file.path}, {"checksum", file.checksum}});
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace restage
