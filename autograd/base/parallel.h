// Threads. Work is cut by sizes only, never by the number of threads, so every result has the same
// bits for any number of threads. The only place (with parallel.cpp) that knows oneTBB.
#pragma once

#include <cstdint>
#include <functional>

namespace restage {

/// Number of threads used by parallel_for from now on (0: all cores).
void set_threads(int n);
int threads();

/// Calls body(begin, end) for consecutive pieces of [0, n) of `grain` items (the last may be
/// shorter), on any thread, in any order. The pieces depend on n and grain only.
void parallel_for(int64_t n, int64_t grain, const std::function<void(int64_t, int64_t)>& body);

}  // namespace restage
