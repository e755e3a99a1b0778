// Signals as the program handles them (autograd/base/interrupt.h), in a test.
#pragma once

#include <signal.h>

#include "autograd/base/interrupt.h"

namespace restage::test {

/// While it lives, signals are handled as in the program. Afterwards they end the process again,
/// and those that came are forgotten.
struct HandledSignals {
  HandledSignals() { handle_signals(); }
  ~HandledSignals() {
    handle_signals();
    for (const int number : {SIGINT, SIGTERM, SIGPIPE, SIGXFSZ}) ::signal(number, SIG_DFL);
  }
  HandledSignals(const HandledSignals&) = delete;
  HandledSignals& operator=(const HandledSignals&) = delete;
};

}  // namespace restage::test
