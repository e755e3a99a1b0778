// Work in a child process. What reads a hostile file may crash, fill the memory or find no end; the
// child does so alone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace restage {

/// What a child may take.
struct ChildLimits {
  uint64_t memory;   ///< bytes of address space, on top of what this process has
  unsigned seconds;  ///< of processor time
  /// Seconds by the clock in which it hardly works: it waits for something. Who works slowly, since
  /// the machine is busy, goes on.
  unsigned clock = 10 * seconds;
};

struct ChildResult {
  enum class End {
    answered,   ///< `answer` is what the work returned
    crashed,    ///< it fell over, or left without an answer
    no_memory,  ///< it threw std::bad_alloc
    no_end      ///< it went beyond a limit on its time
  };
  End end = End::crashed;
  std::string answer;
};

/// Runs `work` in a copy of this process and returns how that ended. The child prints nothing and
/// dies with its parent. Signals that ask to stop (Ctrl-C) are the parent's business: the child
/// does not hear them, and if the wish comes while the child works (stop_requested()), the child is
/// ended and Interrupted is thrown. How the host of this process treats SIGCHLD makes no
/// difference. Where this process has other threads, a child that finds no end is replaced once: it
/// may wait for a lock of a thread that the copy does not have. WorkError naming `where`: no child
/// could be started, or somebody killed it.
ChildResult in_a_child(const ChildLimits& limits, const std::string& where,
                       const std::function<std::string()>& work);

}  // namespace restage
