// Being asked to stop: by a signal, and by a host program, such as Python, that handles signals
// itself.
#include "autograd/base/interrupt.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "tests/support/handled_signals.h"

namespace restage {
namespace {

TEST(Interrupt, AHostIsAskedInItsOwnThreadWhileItIsThere) {
  EXPECT_FALSE(stop_requested());
  int asked = 0;
  bool stop = false;
  {
    const HostSignals outer([&] { return ++asked, stop; });
    EXPECT_FALSE(stop_requested());
    EXPECT_NO_THROW(throw_if_stopped());
    std::thread([] { EXPECT_FALSE(stop_requested()); }).join();
    EXPECT_EQ(asked, 2);
    {
      const HostSignals inner([] { return true; });
      EXPECT_TRUE(stop_requested());
    }
    EXPECT_FALSE(stop_requested()) << "what an inner one said is forgotten with it";
    stop = true;
    EXPECT_THROW(throw_if_stopped(), Interrupted);
  }
  EXPECT_FALSE(stop_requested());
}

TEST(Interrupt, InAScopeOtherThreadsAreToldWhatAHostSays) {
  const StopScope scope;
  const HostSignals host([] { return true; });
  std::thread([] { EXPECT_FALSE(stop_requested()); }).join();
  EXPECT_TRUE(stop_requested());
  std::thread([] { EXPECT_TRUE(stop_requested()); }).join();
}

/// Two threads of a host, each at a command of its own, in scopes that overlap.
TEST(Interrupt, AHostsWishIsForItsOwnCommandAndEndsWithIt) {
  const StopScope another;  // of a command that goes on
  {
    const HostSignals host([] { return true; });
    EXPECT_TRUE(stop_requested());
    std::thread([] {
      const HostSignals own([] { return false; });
      EXPECT_FALSE(stop_requested()) << "that of another thread";
    }).join();
  }
  const StopScope next;
  EXPECT_FALSE(stop_requested());
}

TEST(Interrupt, WhatWasAskedOfAScopeEndsWithIt) {
  {
    const StopScope scope;
    ask_to_stop();
    EXPECT_TRUE(stop_requested());
  }
  const StopScope scope;
  EXPECT_FALSE(stop_requested());
}

TEST(Interrupt, ASignalIsForTheWholeProcessAndNotForOneScope) {
  const test::HandledSignals handled;
  {
    const StopScope scope;
    ::raise(SIGTERM);
  }
  EXPECT_TRUE(stop_requested()) << "between two scopes";
  const StopScope next;
  EXPECT_TRUE(stop_requested());
  try {
    throw_if_stopped();
    FAIL() << "not stopped";
  } catch (const Interrupted& stopped) {
    EXPECT_EQ(stopped.exit_code, 143);
  }
  handle_signals();
  EXPECT_FALSE(stop_requested()) << "a process that begins anew";
}

/// A process whose two threads get a signal at the same moment; its exit code.
int after_two_signals_at_once() {
  const pid_t child = ::fork();
  if (child == 0) {
    handle_signals();
    const StopScope scope;
    std::atomic<int> ready{0};
    const auto get = [&ready] {
      for (++ready; ready.load() < 2;) {
      }
      ::pthread_kill(::pthread_self(), SIGTERM);
    };
    std::thread other(get);
    get();
    other.join();
    ::_exit(stop_requested() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Interrupt, TwoSignalsAtOnceAreOneRequest) {
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(after_two_signals_at_once(), 0) << i;
}

}  // namespace
}  // namespace restage
