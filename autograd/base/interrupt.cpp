#include "autograd/base/interrupt.h"

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <utility>

#include "autograd/base/temporary.h"

namespace restage {
namespace {

std::atomic<int> scopes{0};
std::atomic<int> caught{0};
std::atomic<bool> asked{false};
std::atomic<int64_t> caught_at{0};  // milliseconds; 0: no signal has come
std::atomic<int> wishes{0};         // of hosts
thread_local HostSignals* host = nullptr;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<int64_t>::is_always_lock_free,
              "used in a signal handler");

constexpr int64_t kSameRequest = 500;  // milliseconds

int64_t now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

/// A terminal and a program such as timeout(1) may both send the one signal that somebody asked
/// for. The time decides which signal is the first, so that every other finds it.
void on_signal(int signal) {
  if (scopes.load() > 0) {
    const int64_t time = now();
    int64_t none = 0;
    if (caught_at.compare_exchange_strong(none, time)) {
      caught = signal;
      return;
    }
    if (time - caught_at.load() < kSameRequest) return;
  }
  remove_temporaries();
  _exit(128 + signal);
}

}  // namespace

void handle_signals() {
  caught = 0, caught_at = 0;
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  for (const int one : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2}) sigaction(one, &action, nullptr);
  // Under nohup a terminal that closes ends nothing.
  struct sigaction inherited {};
  sigaction(SIGHUP, nullptr, &inherited);
  if (inherited.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGCHLD, SIG_DFL);  // a caller that ignores it hands that on: nobody would hear of trials
  signal(SIGXFSZ, SIG_IGN);  // a file that may not grow: writing fails, and is cleaned up after
}

StopScope::StopScope() { ++scopes; }
// What was asked ends with the outermost scope. A signal does not, since nobody can know whether
// the scope has seen it.
StopScope::~StopScope() {
  if (--scopes == 0) asked = false;
}

void ask_to_stop() {
  if (scopes.load() > 0) asked = true;
}

HostSignals::HostSignals(std::function<bool()> ask) : ask_(std::move(ask)), outer_(host) {
  host = this;
}
HostSignals::~HostSignals() {
  host = outer_;
  if (wanted_) --wishes;
}

bool HostSignals::wants() {
  if (!wanted_ && ask_()) wanted_ = true, ++wishes;
  return wanted_;
}

bool stop_requested() {
  if (caught.load() != 0 || asked.load()) return true;
  return host != nullptr ? host->wants() : wishes.load() > 0;
}

void throw_if_stopped() {
  if (!stop_requested()) return;
  const int signal = caught.load();
  throw Interrupted(signal != 0 ? signal : SIGTERM);
}

}  // namespace restage
