// A child process that crashes, grows, finds no end or is killed, and a host with SIGCHLD of its
// own.
#include "autograd/base/child_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "autograd/base/interrupt.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using namespace test;
using enum ChildResult::End;
using Work = std::function<std::string()>;

constexpr ChildLimits kLimits{uint64_t{1} << 30, 20, 30};

ChildResult run(const Work& work, const ChildLimits& limits = kLimits) {
  return in_a_child(limits, "x.h5", work);
}

std::string sleep_long() {
  for (int i = 0; i < 60; ++i) ::sleep(1);
  return "slept";
}

/// ThreadSanitizer hands a signal on at a call that may wait, so there is one.
std::string spin() {
  for (volatile bool on = true;; ::usleep(0))
    for (int i = 0; on && i < 10'000'000; ++i) {
    }
}

/// Fills the stack: the result is needed after the call, so each call keeps its frame.
int overflow(int depth) {
  volatile char frame[4096];
  frame[depth % 4096] = 1;
  return depth < 0 ? 0 : overflow(depth + 1) + frame[depth % 4096];
}

/// How this process treats a signal, while the object exists.
struct Treats {
  Treats(int which, void (*handler)(int)) : signal(which) {
    struct sigaction action {};
    action.sa_handler = handler;
    ::sigaction(signal, &action, &before);
  }
  ~Treats() { ::sigaction(signal, &before, nullptr); }
  Treats(const Treats&) = delete;
  Treats& operator=(const Treats&) = delete;
  int signal;
  struct sigaction before {};
};

void wait_for_all(int) {
  const int before = errno;
  while (::waitpid(-1, nullptr, WNOHANG) > 0) {
  }
  errno = before;
}

TEST(ChildProcess, AnswersAnySize) {
  for (const size_t size : {0, 1, 5'000'000}) {
    const ChildResult got = run([&] { return std::string(size, 'A'); });
    EXPECT_TRUE(got.end == answered && got.answer == std::string(size, 'A')) << size;
  }
}

TEST(ChildProcess, ACrashIsTheChildsAlone) {
  const std::vector<Work> works = {[] { return ::abort(), ""; },
                                   [] { return ::raise(SIGSEGV), ""; },
                                   [] { return std::string(overflow(0) ? "a" : "b"); },
                                   [] { return ::_exit(0), ""; }, []() -> std::string { throw 1; }};
  for (size_t i = 0; i < works.size(); ++i) EXPECT_EQ(run(works[i]).end, crashed) << i;
}

TEST(ChildProcess, TimeOfTheProcessorAndOfTheClockAreLimited) {
  EXPECT_EQ(run(spin, {kLimits.memory, 1, 30}).end, no_end);
  EXPECT_EQ(run(sleep_long, {kLimits.memory, 20, 1}).end, no_end);
}

/// The copy of a process has one thread. A lock that another thread held is never opened in it.
TEST(ChildProcess, AChildThatWaitsForALockOfAnotherThreadIsReplaced) {
  std::mutex lock;
  std::atomic<bool> held = false;
  std::thread other([&] {
    const std::lock_guard<std::mutex> guard(lock);
    held = true;
    std::this_thread::sleep_for(std::chrono::seconds(2));
  });
  while (!held) std::this_thread::yield();
  const auto ask = [&] { return std::lock_guard<std::mutex>(lock), std::string("good"); };
  EXPECT_EQ(run(ask).answer, "good");
  other.join();
}

TEST(ChildProcess, TimeIsLimitedWhereTheThreadBlocksSignals) {
  sigset_t all, before;
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  EXPECT_EQ(run(sleep_long, {kLimits.memory, 20, 1}).end, no_end);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

TEST(ChildProcess, MemoryIsLimited) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer ends a process whose allocation fails";
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  GTEST_SKIP() << "a sanitizer ends a process whose allocation fails";
#endif
#endif
  const auto take = [](size_t bytes) {
    return [bytes] { return std::string(bytes, 'x').substr(0, 1); };
  };
  EXPECT_EQ(run(take(size_t{2} << 30)).end, no_memory);
  EXPECT_EQ(run(take(size_t{500} << 20)).answer, "x") << "what this process has does not count";
}

/// A host that ignores SIGCHLD, or waits for all children, takes the status away.
TEST(ChildProcess, AHostMayTreatSigchldAsItLikes) {
  for (void (*const handler)(int) : {SIG_IGN, &wait_for_all}) {
    const Treats host(SIGCHLD, handler);
    EXPECT_EQ(run([] { return "good"; }).answer, "good");
    EXPECT_EQ(run([] { return ::abort(), ""; }).end, crashed);
    EXPECT_EQ(run(spin, {kLimits.memory, 1, 30}).end, no_end);
    EXPECT_THROW(run([] { return ::raise(SIGKILL), ""; }), WorkError);
  }
}

/// On a busy machine the child waits for the processor most of the time.
TEST(ChildProcess, WhoWorksSlowlyGoesOn) {
  const auto slowly = [] {
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(2500)) {
      const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
      while (std::chrono::steady_clock::now() < until) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(80));
    }
    return std::string("done");
  };
  EXPECT_EQ(run(slowly, {kLimits.memory, 20, 1}).answer, "done");
}

TEST(ChildProcess, WhoKillsItIsNotTakenForTheFile) {
  expect_error<WorkError>([] { run([] { return ::raise(SIGKILL), ""; }); },
                          {"x.h5: ", "was killed"});
}

/// Ctrl-C goes to all processes of a terminal: what it means is the parent's business.
TEST(ChildProcess, SignalsThatAskToStopAreTheParents) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    EXPECT_EQ(run([&] { return ::raise(signal), "went on"; }).answer, "went on") << signal;
}

TEST(ChildProcess, AWishToStopEndsTheChild) {
  const auto start = std::chrono::steady_clock::now();
  int asked = 0;
  const HostSignals host([&] { return ++asked > 2; });
  EXPECT_THROW(run(sleep_long), Interrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  EXPECT_EQ(run([] { return "good"; }).answer, "good")
      << "who is being stopped may still read what that takes";
}

TEST(ChildProcess, DiesWithItsParent) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // the orphan becomes a child of this process
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t parent = ::fork();
  if (parent == 0) {
    run([&] {
      const pid_t own = ::getpid();
      return ::write(ends[1], &own, sizeof own) == sizeof own ? sleep_long() : "";
    });
    ::_exit(0);
  }
  pid_t child = 0;
  ASSERT_EQ(::read(ends[0], &child, sizeof child), ssize_t{sizeof child});
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  int status = 0;
  pid_t ended = 0;
  for (int i = 0; i < 100 && ended == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ended = ::waitpid(child, &status, WNOHANG);
  }
  ::kill(child, SIGKILL);
  ::prctl(PR_SET_CHILD_SUBREAPER, 0);
  ::close(ends[0]), ::close(ends[1]);
  EXPECT_EQ(ended, child);
  EXPECT_TRUE(WIFSIGNALED(status));
}

}  // namespace
}  // namespace restage
