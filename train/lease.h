// Who works on something: a claim that outlives nobody. Several processes, on several hosts that
// share a file system, may want to make the same artifact or run the same trial; one gets the
// lease.
//
//   auto lease = Lease::take(dir + "/lease", "trial 4f2a");
//   if (!lease) return busy(Lease::holder(dir + "/lease"));
//   if (is_done(dir)) return;             // always after taking: somebody may just have finished
//   ... work, looking at lease->lost() now and then ...
//   publish(dir); lease->forget();
//
// A lease at `path` is a row of files `path.1`, `path.2`, ...; the last one counts. To take it is
// to link the next number, which only one process can do; no file is ever taken away from its
// holder, so there is no moment in which two could hold it, and nothing needs a lock server. A
// lease is free if there is none, if it says released, or if its holder is dead:
//  - on the same host (boot and process namespace) when no process has its number and start time,
//    which is known at once;
//  - on another host when its heartbeat, a counter, has not changed during `patience` of our own
//    monotonic clock. No wall clock is ever read, so one that jumps does not matter.
// A holder that was suspended for longer than that may have lost its lease: lost() says so, and
// what it publishes must be the same bytes as its successor's, or be guarded by lost().
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace restage {

struct LeaseOptions {
  double beat = 5;       ///< seconds between heartbeats
  double patience = 30;  ///< seconds without one after which a holder on another host is dead
  /// Called after every heartbeat from a thread of its own; what it throws is dropped.
  std::function<void()> on_beat;
};

/// What the file of a lease says.
struct LeaseHolder {
  std::string host, who;
  int64_t pid = 0, beat = 0;
  /// The holder is on this host, so its process number and start time decide whether it lives.
  bool here = false;
  std::string text() const;  ///< "process 12 on host a (trial 4f2a)"
};

class Lease {
 public:
  /// The lease, or nothing if somebody alive holds it. If the holder is on another host this waits
  /// until its heartbeat moves or `patience` is over. `who`: for people. InputError: the folder of
  /// `path` is not there or may not be written; WorkError: no space.
  static std::optional<Lease> take(const std::string& path, const std::string& who,
                                   LeaseOptions options = {});
  /// Who holds the lease, answered at once: nothing if the lease is free or if its holder was on
  /// this host and is dead. A holder on another host counts as alive.
  static std::optional<LeaseHolder> holder(const std::string& path);

  Lease(Lease&&) noexcept;
  Lease& operator=(Lease&&) = delete;
  ~Lease();  ///< releases

  /// Whether somebody else holds the lease now, or might: this process was, or will be, taken for
  /// dead.
  bool lost() const;
  /// The work is done and will be seen to be done: removes the lease's files, and the files of
  /// processes that died while they held it.
  void forget();

 private:
  struct State;
  explicit Lease(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace restage
