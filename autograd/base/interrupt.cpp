#include "autograd/base/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>

#include "autograd/base/temporary.h"

namespace restage {
namespace {

std::atomic<int> scopes{0};
std::atomic<int> caught{0};
std::atomic<bool> asked{false};
static_assert(std::atomic<int>::is_always_lock_free, "used in a signal handler");

void on_signal(int signal) {
  int none = 0;
  if (scopes.load() > 0 && caught.compare_exchange_strong(none, signal)) return;
  remove_temporaries();
  _exit(128 + signal);
}

}  // namespace

void handle_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

// A signal that an earlier scope answered does not stop this one.
StopScope::StopScope() {
  if (scopes.load() == 0) caught = 0, asked = false;
  ++scopes;
}
StopScope::~StopScope() { --scopes; }

void ask_to_stop() {
  if (scopes.load() > 0) asked = true;
}

bool stop_requested() { return caught.load() != 0 || asked.load(); }

void throw_if_stopped() {
  if (const int signal = caught.load(); signal != 0) throw Interrupted(signal);
  if (asked.load()) throw Interrupted(SIGTERM);
}

}  // namespace restage
