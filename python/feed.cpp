#include "python/feed.h"

#include <unistd.h>

#include <chrono>
#include <utility>

#include "autograd/base/error.h"

namespace restage::python {

Feed::Feed(Draw draw, int64_t start, int64_t end, size_t ahead)
    : draw_(std::move(draw)), end_(end), ahead_(ahead), process_(::getpid()), number_(start) {}

Feed::~Feed() {
  // After a fork the thread is the parent's; there is nobody here to wait for.
  if (::getpid() == process_)
    close();
  else if (thread_.joinable())
    thread_.detach();
}

void Feed::require_this_process() const {
  if (::getpid() != process_)
    throw InputError("", "these batches belong to the process that made them, before it forked",
                     "make them in the process that takes them");
}

void Feed::work(int64_t first) {
  for (int64_t k = first;; ++k) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [&] { return closed_ || ready_.size() < ahead_; });
      if (closed_ || k >= end_) return;
    }
    NamedTensors batch;
    std::exception_ptr failure;
    try {
      batch = draw_(k);
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    if (failure)
      failure_ = failure;
    else
      ready_.push_back(std::move(batch));
    changed_.notify_all();
    if (failure) return;
  }
}

std::optional<NamedTensors> Feed::next(const std::function<void()>& look) {
  require_this_process();
  std::unique_lock<std::mutex> lock(mutex_);
  if (closed_ || number_ >= end_) return std::nullopt;
  if (ahead_ == 0) return draw_(number_++);
  if (!thread_.joinable()) thread_ = std::thread([this, first = number_] { work(first); });
  // Several threads may take from one feed, and another one may take the last batch.
  while (ready_.empty() && !failure_ && !closed_ && number_ < end_) {
    if (changed_.wait_for(lock, std::chrono::milliseconds(100)) == std::cv_status::no_timeout)
      continue;
    lock.unlock();
    look();
    lock.lock();
  }
  if (ready_.empty()) {
    closed_ = true;
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::nullopt;
  }
  NamedTensors out = std::move(ready_.front());
  ready_.pop_front();
  ++number_;
  changed_.notify_all();
  return out;
}

int64_t Feed::number() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return number_;
}

size_t Feed::ready() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ready_.size();
}

void Feed::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

}  // namespace restage::python
