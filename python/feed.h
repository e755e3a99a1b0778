// Batches that a thread draws ahead of whoever takes them.
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include "autograd/tensor/tensor.h"

namespace restage::python {

/// Batches number `start` to `end` - 1, in order. The thread begins with the first next(), never
/// takes the GIL, and waits while `ahead` batches are ready (0: no thread, next() draws). The bits
/// do not depend on it. A batch that cannot be drawn is an exception of the next() that would give
/// it, and the end of the feed.
class Feed {
 public:
  using Draw = std::function<NamedTensors(int64_t)>;
  static constexpr int64_t kEndless = std::numeric_limits<int64_t>::max();

  Feed(Draw draw, int64_t start, int64_t end, size_t ahead);
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  /// The next batch; nothing at the end. Without the GIL. `look` is called about ten times a second
  /// while it waits, and may throw.
  std::optional<NamedTensors> next(const std::function<void()>& look);
  /// The number of the batch that next() gives.
  int64_t number() const;
  /// How many batches are drawn and not taken.
  size_t ready() const;
  /// Any batch, now.
  NamedTensors at(int64_t number) const { return draw_(number); }
  /// Ends the thread; next() gives nothing any more.
  void close();

 private:
  void work(int64_t first);
  void require_this_process() const;

  const Draw draw_;
  const int64_t end_;
  const size_t ahead_;
  const pid_t process_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int64_t number_;  // of the batch that next() gives
  std::deque<NamedTensors> ready_;
  std::exception_ptr failure_;  // of the batch behind those that are ready
  bool closed_ = false;
  std::thread thread_;
};

}  // namespace restage::python
