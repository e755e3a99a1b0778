#include "autograd/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "autograd/base/thread_groups.h"

namespace restage {
namespace {
std::mutex limit_mutex;  // of the next two
std::unique_ptr<tbb::global_control> limit;
// By their sizes. None is ever destroyed, not even at exit: another thread may be at work in it.
std::map<int, std::unique_ptr<tbb::task_arena>>& arenas =
    *new std::map<int, std::unique_ptr<tbb::task_arena>>;
std::atomic<tbb::task_arena*> arena{nullptr};
std::atomic<int> requested{0};
std::atomic<int64_t> cut{0};

/// The threads of a group; of whichever group this thread works in.
struct GroupOfThreads {
  tbb::task_arena* arena;
  int size;
};
thread_local const GroupOfThreads* group = nullptr;

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

namespace {
/// Runs work on the threads that set_threads() or in_groups() gives.
template <class F>
void run_all(const F& work) {
  if (group != nullptr)
    group->arena->execute(work);
  else if (tbb::task_arena* chosen = arena.load())
    chosen->execute(work);
  else
    work();
}
}  // namespace

void set_threads(int n) {
  const std::lock_guard lock(limit_mutex);
  requested = n;
  limit.reset();
  arena = nullptr;
  if (n <= 0) return;
  limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                static_cast<size_t>(n));
  // An arena of n slots, so that more threads than cores can be asked for (determinism tests do).
  std::unique_ptr<tbb::task_arena>& wanted = arenas[n];
  if (!wanted) wanted = std::make_unique<tbb::task_arena>(n);
  arena = wanted.get();
}

int threads() {
  if (group != nullptr) return group->size;
  const int n = requested;
  return n > 0 ? n : tbb::this_task_arena::max_concurrency();
}

void parallel_for(int64_t n, int64_t grain, PieceRef body) {
  if (n <= 0) return;
  grain = std::max<int64_t>(1, grain);
  const int64_t pieces = (n + grain - 1) / grain;
  cut.fetch_add(pieces, std::memory_order_relaxed);
  const auto piece = [&](int64_t i) { body(i * grain, std::min(n, (i + 1) * grain)); };
  if (pieces == 1 || (group != nullptr ? group->size : requested.load()) == 1) {
    for (int64_t i = 0; i < pieces; ++i) piece(i);
    return;
  }
  // Each thread has one task, which takes the next piece until none is left. So handing out a piece
  // costs an addition, not a task of the library.
  std::atomic<int64_t> next{0};
  const auto take = [&](int64_t) {
    see(forked);
    for (int64_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < pieces;) piece(i);
    leave(joined);
  };
  const int64_t takers = std::min<int64_t>(pieces, threads());
  const auto work = [&] { tbb::parallel_for(int64_t{0}, takers, take, tbb::simple_partitioner()); };
  leave(forked);
  run_all(work);
  see(joined);
}

int64_t pieces_cut() { return cut.load(std::memory_order_relaxed); }

void in_groups(int64_t n, int groups, const std::function<void(int64_t)>& body) {
  if (n <= 0) return;
  const int all = threads();
  groups = static_cast<int>(std::clamp<int64_t>(groups, 1, std::min<int64_t>(all, n)));
  if (groups <= 1) {
    for (int64_t i = 0; i < n; ++i) body(i);
    return;
  }
  std::vector<std::exception_ptr> failed(static_cast<size_t>(groups));
  const auto of_group = [&](int g) {
    see(forked);
    const int size = all / groups + (g < all % groups ? 1 : 0);
    // A thread that waits in its own arena takes no work of another group.
    tbb::task_arena own(size);
    const GroupOfThreads threads_of_it{&own, size};
    const GroupOfThreads* outer = std::exchange(group, &threads_of_it);
    try {
      for (int64_t i = g; i < n; i += groups) body(i);
    } catch (...) {
      failed[static_cast<size_t>(g)] = std::current_exception();
    }
    group = outer;
    leave(joined);
  };
  leave(forked);
  run_all([&] { tbb::parallel_for(0, groups, of_group, tbb::simple_partitioner()); });
  see(joined);
  for (const std::exception_ptr& e : failed)
    if (e) std::rethrow_exception(e);
}

}  // namespace restage
