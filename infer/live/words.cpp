#include "infer/live/words.h"

#include "autograd/base/log.h"

namespace restage::live {

void Words::warn(const std::string& kind, const std::string& text) {
  constexpr std::chrono::seconds kApart{5};
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const auto [at, first] = said_.try_emplace(kind);
  Said& said = at->second;
  if (!first && now - said.when < kApart) {
    ++said.left_out;
    return;
  }
  log_warning(text + (said.left_out == 0 ? ""
                                         : " (and " + std::to_string(said.left_out) +
                                               " times more since this was last said)"));
  said = {now, 0};
}

}  // namespace restage::live
