#include "experiments/slow_work.h"

#include <chrono>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"

namespace restage {
namespace {

constexpr std::chrono::seconds kFirst{2}, kNext{5};

}  // namespace

SlowWork::SlowWork() : thread_([this] { watch(); }) {}

SlowWork::~SlowWork() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void SlowWork::on(std::string what) {
  throw_if_stopped();
  const std::lock_guard lock(mutex_);
  what_ = std::move(what);
}

void SlowWork::watch() {
  std::unique_lock lock(mutex_);
  for (auto pause = kFirst; !wake_.wait_for(lock, pause, [this] { return ending_; });
       pause = kNext) {
    if (what_.empty() || what_ == said_) continue;
    said_ = what_;
    log_info("still at work: " + what_);
  }
}

}  // namespace restage
