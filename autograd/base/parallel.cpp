#include "autograd/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>

namespace restage {
namespace {
std::unique_ptr<tbb::global_control> limit;
std::unique_ptr<tbb::task_arena> arena;
std::mutex limit_mutex;
int requested = 0;

// ThreadSanitizer cannot see how oneTBB, which is not compiled for it, hands work out and waits for
// it. Two marks tell it: every piece comes after the fork, the join after every piece. No piece
// sees another's mark, so a race between two of them is still found. (CMakeLists.txt leaves this
// file, and with it the library's templates, out of the instrumentation.)
#ifdef RESTAGE_TSAN
char forked, joined;
extern "C" void __tsan_release(void* mark);
extern "C" void __tsan_acquire(void* mark);
void leave(char& mark) { __tsan_release(&mark); }
void see(char& mark) { __tsan_acquire(&mark); }
#else
constexpr char forked = 0, joined = 0;
void leave(char) {}
void see(char) {}
#endif
}  // namespace

void set_threads(int n) {
  const std::lock_guard lock(limit_mutex);
  requested = n;
  limit.reset();
  arena.reset();
  if (n <= 0) return;
  limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                static_cast<size_t>(n));
  // An arena of n slots, so that more threads than cores can be asked for (determinism tests do).
  arena = std::make_unique<tbb::task_arena>(n);
}

int threads() { return requested > 0 ? requested : tbb::this_task_arena::max_concurrency(); }

void parallel_for(int64_t n, int64_t grain, PieceRef body) {
  if (n <= 0) return;
  grain = std::max<int64_t>(1, grain);
  const int64_t pieces = (n + grain - 1) / grain;
  const auto piece = [&](int64_t i) { body(i * grain, std::min(n, (i + 1) * grain)); };
  if (pieces == 1 || requested == 1) {
    for (int64_t i = 0; i < pieces; ++i) piece(i);
    return;
  }
  // One task a thread, each taking the next piece until none is left: handing a piece out costs an
  // addition, not a task of the library.
  std::atomic<int64_t> next{0};
  const auto take = [&](int64_t) {
    see(forked);
    for (int64_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < pieces;) piece(i);
    leave(joined);
  };
  const int64_t takers = std::min<int64_t>(pieces, threads());
  const auto work = [&] { tbb::parallel_for(int64_t{0}, takers, take, tbb::simple_partitioner()); };
  leave(forked);
  if (arena) {
    arena->execute(work);
  } else {
    work();
  }
  see(joined);
}

}  // namespace restage
