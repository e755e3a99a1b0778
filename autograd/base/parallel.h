// Threads. Work is cut by sizes only, never by the number of threads, so every result has the same
// bits for any number of threads. No other file (but parallel.cpp) knows oneTBB.
#pragma once

#include <cstdint>
#include <type_traits>

namespace restage {

/// Number of threads used by parallel_for from now on (0: all cores). May be called while other
/// threads are at work, who keep those that they have.
void set_threads(int n);
int threads();

/// A callable (begin, end) that the caller keeps alive: a reference, so nothing is allocated.
class PieceRef {
 public:
  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, PieceRef>)
      PieceRef(F&& f)  // NOLINT: any callable is one
      : object_(const_cast<void*>(static_cast<const void*>(&f))),
        call_([](void* object, int64_t begin, int64_t end) {
          (*static_cast<std::remove_reference_t<F>*>(object))(begin, end);
        }) {}
  void operator()(int64_t begin, int64_t end) const { call_(object_, begin, end); }

 private:
  void* object_;
  void (*call_)(void* object, int64_t begin, int64_t end);
};

/// Calls body(begin, end) for consecutive pieces of [0, n) of `grain` items (the last may be
/// shorter), on any thread, in any order. The pieces depend on n and grain only.
void parallel_for(int64_t n, int64_t grain, PieceRef body);

/// Pieces that all calls of parallel_for() were cut into so far. How work is cut decides how many
/// threads can share it, and unlike the time that they take it is the same on every machine.
int64_t pieces_cut();

}  // namespace restage
