// What a stream says on standard error while it goes on: each kind of trouble at most every few
// seconds, so that trouble in every frame does not fill the screen.
#pragma once

#include <map>
#include <mutex>
#include <string>

#include "infer/live/cloud.h"

namespace restage::live {

class Words {
 public:
  /// Logs a warning; of the same `kind` at most one in five seconds, which then says how many were
  /// left out. May be called by any thread.
  void warn(const std::string& kind, const std::string& text);

 private:
  struct Said {
    Clock::time_point when;
    int64_t left_out = 0;
  };
  std::mutex mutex_;
  std::map<std::string, Said> said_;  ///< by kind, of which there are a handful
};

}  // namespace restage::live
