// Signals that end a program: SIGINT and SIGTERM, SIGHUP (a terminal closes), SIGUSR1 and SIGUSR2
// (what schedulers send before time is up). By default they end the program at once with exit code
// 128 + signal (130, 143 ...), and files that it was writing are removed (temporary.h); inside a
// StopScope they only set a flag, so that a training run can write a checkpoint first.
#pragma once

#include <functional>

#include "autograd/base/error.h"

namespace restage {

/// The program was asked to stop; exit_code is 128 + signal.
class Interrupted : public Error {
 public:
  explicit Interrupted(int signal)
      : Error("stopped by a signal; run it again or resume it", 128 + signal) {}
};

/// Installs the handlers; writing to a closed pipe becomes an ordinary error instead of a signal.
/// Called once by the program, when it begins. A host program that handles signals itself leaves it
/// out; who calls it again forgets the signals that came before.
void handle_signals();

/// While a StopScope exists, the first signal sets the flag and the second signal ends the program.
/// What comes within half a second of the first belongs to it: a wrapper such as timeout(1) sends
/// its signal to the program and to the program's group. The flag of a signal stays set after the
/// scope: a program that was told to end does not go on with its next piece of work.
class StopScope {
 public:
  StopScope();
  ~StopScope();
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;
};

/// Does what a first signal in a StopScope does, for a program that was asked to stop in another
/// way; but what was asked ends with the outermost scope. If a signal comes as well, it still
/// counts as the first.
void ask_to_stop();

/// While it exists, stop_requested() in this thread also asks a host program that handles signals
/// itself, such as Python. `ask` returns whether to stop, and must not throw. A wish of the host
/// also reaches threads that have no host, and ends with this object.
class HostSignals {
 public:
  explicit HostSignals(std::function<bool()> ask);
  ~HostSignals();
  HostSignals(const HostSignals&) = delete;
  HostSignals& operator=(const HostSignals&) = delete;

 private:
  friend bool stop_requested();
  bool wants();

  std::function<bool()> ask_;
  bool wanted_ = false;
  HostSignals* outer_;
};

/// True after a signal in a StopScope, after ask_to_stop(), or where a host says so.
bool stop_requested();
/// Throws Interrupted if stop_requested().
void throw_if_stopped();

}  // namespace restage
