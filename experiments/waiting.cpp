#include "experiments/waiting.h"

#include <chrono>

#include "autograd/base/log.h"

namespace restage {
namespace {

constexpr std::chrono::seconds kFirst{2}, kNext{5};

}  // namespace

Waiting::Waiting() : thread_([this] { watch(); }) {}

Waiting::~Waiting() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Waiting::on(std::string what) {
  const std::lock_guard lock(mutex_);
  what_ = std::move(what);
}

void Waiting::watch() {
  std::unique_lock lock(mutex_);
  for (auto pause = kFirst; !wake_.wait_for(lock, pause, [this] { return ending_; });
       pause = kNext) {
    if (what_.empty() || what_ == said_) continue;
    said_ = what_;
    log_info("still at work: " + what_);
  }
}

}  // namespace restage
