#include "infer/live/cloud.h"

#include <utility>

namespace restage::live {

void Mailbox::put(LiveCloud& cloud) {
  {
    const std::lock_guard lock(mutex_);
    ++counts_.arrived;
    counts_.overtaken += full_;
    std::swap(held_, cloud);
    full_ = true;
  }
  wake_.notify_one();
}

void Mailbox::pass(int64_t clouds) {
  const std::lock_guard lock(mutex_);
  counts_.arrived += clouds;
  counts_.overtaken += clouds;
}

void Mailbox::refuse() {
  const std::lock_guard lock(mutex_);
  ++counts_.arrived;
  ++counts_.refused;
}

void Mailbox::leave_out() {
  const std::lock_guard lock(mutex_);
  ++counts_.arrived;
  ++counts_.other_sender;
}

void Mailbox::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  wake_.notify_one();
}

bool Mailbox::take(LiveCloud& out, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, wait, [&] { return full_ || closed_; });
  if (!full_) return false;
  std::swap(held_, out);
  full_ = false;
  return true;
}

bool Mailbox::ended() const {
  const std::lock_guard lock(mutex_);
  return closed_ && !full_;
}

Mailbox::Counts Mailbox::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace restage::live
