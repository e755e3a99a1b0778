#include "train/lease.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"

namespace restage {
namespace {

class LeaseTest : public test::FileTest {
 protected:
  std::string text(int number) const {
    return test::bytes_of(path_ + "." + std::to_string(number));
  }
  /// Makes the last lease one of another host with this heartbeat.
  void move_to_another_host(int number, int beat) {
    std::string record = text(number);
    record.replace(record.find("\"world\":\"") + 9, 8, "elsewher");
    record.replace(record.find("\"released\":") + 11, 1, "0");
    const size_t at = record.find("\"beat\":") + 7;
    char digits[24];
    std::snprintf(digits, sizeof digits, "%20d", beat);
    record.replace(at, 20, digits);
    write(number, record);
  }
  /// In place, as heartbeats are.
  void write(int number, const std::string& record) const {
    std::fstream(path_ + "." + std::to_string(number), std::ios::in | std::ios::out) << record;
  }

  const std::string path_ = dir / "lease";
};

TEST_F(LeaseTest, OneHolderAtATime) {
  {
    auto first = Lease::take(path_, "trial a");
    ASSERT_TRUE(first);
    EXPECT_FALSE(Lease::take(path_, "trial a"));
    const auto holder = Lease::holder(path_);
    ASSERT_TRUE(holder);
    EXPECT_EQ(holder->pid, ::getpid());
    EXPECT_TRUE(holder->here);
    EXPECT_HAS(holder->text(), "trial a");
    EXPECT_FALSE(first->lost());
    Lease moved = std::move(*first);
    EXPECT_FALSE(Lease::take(path_, "trial a"));
  }
  EXPECT_FALSE(Lease::holder(path_));
  auto second = Lease::take(path_, "trial a");
  ASSERT_TRUE(second);
  second->forget();
  EXPECT_TRUE(test::names_in(dir.path()).empty());
}

TEST_F(LeaseTest, AKilledHolderIsDeadAtOnce) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto lease = Lease::take(path_, "child");
    (void)!::write(ready[1], lease ? "y" : "n", 1);
    ::pause();
    ::_exit(0);
  }
  char answer = 0;
  ASSERT_EQ(::read(ready[0], &answer, 1), 1);
  ASSERT_EQ(answer, 'y');
  EXPECT_FALSE(Lease::take(path_, "parent"));
  ASSERT_EQ(Lease::holder(path_)->pid, child);
  ::kill(child, SIGKILL);
  siginfo_t info{};
  ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT);  // dead, but not yet buried
  EXPECT_FALSE(Lease::holder(path_));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(Lease::take(path_, "parent"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  ::waitpid(child, nullptr, 0);
}

TEST_F(LeaseTest, AProcessNumberThatWasUsedAgainIsNotTheHolder) {
  { auto lease = Lease::take(path_, "a"); }
  std::string record = text(1);
  record.replace(record.find("\"released\":") + 11, 1, "0");
  write(1, record);
  EXPECT_TRUE(Lease::holder(path_)) << "as if this process held it";
  const size_t at = record.find("\"start\":\"") + 9;
  record[at] = record[at] == '9' ? '8' : '9';
  write(1, record);
  EXPECT_FALSE(Lease::holder(path_));
  EXPECT_TRUE(Lease::take(path_, "b"));
}

TEST_F(LeaseTest, OnAnotherHostTheHeartbeatDecides) {
  { auto lease = Lease::take(path_, "far"); }
  move_to_another_host(1, 7);
  const auto holder = Lease::holder(path_);
  ASSERT_TRUE(holder);
  EXPECT_FALSE(holder->here);
  EXPECT_EQ(holder->beat, 7);
  {
    std::atomic<bool> end = false;
    std::thread beating([&] {
      for (int beat = 8; !end; ++beat) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        move_to_another_host(1, beat);
      }
    });
    EXPECT_FALSE(Lease::take(path_, "near", {.beat = 5, .patience = 60, .on_beat = {}}));
    end = true;
    beating.join();
  }
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(Lease::take(path_, "near", {.beat = 5, .patience = 0.5, .on_beat = {}}));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(490));
}

TEST_F(LeaseTest, WhoWasTakenForDeadKnowsIt) {
  auto suspended = Lease::take(path_, "a", {.beat = 1000, .patience = 2000, .on_beat = {}});
  move_to_another_host(1, 0);  // as another host sees it
  auto successor = Lease::take(path_, "b", {.beat = 5, .patience = 0.2, .on_beat = {}});
  ASSERT_TRUE(successor);
  EXPECT_TRUE(suspended->lost());
  EXPECT_FALSE(successor->lost());
  suspended.reset();  // releases nothing that is not its own
  EXPECT_FALSE(successor->lost());
  EXPECT_TRUE(Lease::holder(path_));
}

TEST_F(LeaseTest, BeatsAndCallsBack) {
  std::atomic<int> called = 0;
  auto lease = Lease::take(path_, "a", {.beat = 0.02, .patience = 5, .on_beat = [&] { ++called; }});
  const auto start = std::chrono::steady_clock::now();
  while (Lease::holder(path_)->beat < 3 &&
         std::chrono::steady_clock::now() - start < std::chrono::seconds(20))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_GE(Lease::holder(path_)->beat, 3);
  EXPECT_GE(called, 2);
  EXPECT_FALSE(lease->lost());
}

// Processes that die while they hold the lease, many at once: at no time do two hold it.
TEST_F(LeaseTest, ManyProcessesOneHolder) {
  constexpr int kProcesses = 8, kTurns = 25;
  std::vector<pid_t> children;
  for (int c = 0; c < kProcesses; ++c) {
    const pid_t child = ::fork();
    if (child != 0) {
      children.push_back(child);
      continue;
    }
    for (int turn = 0; turn < kTurns;) {
      auto lease = Lease::take(path_, "child");
      if (!lease) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      const std::string inside = dir / "inside";
      if (::mkdir(inside.c_str(), 0755) != 0) ::_exit(1);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (::rmdir(inside.c_str()) != 0) ::_exit(1);
      ++turn;
      if (turn == kTurns && c % 2 == 0) ::_exit(0);  // without releasing
    }
    ::_exit(0);
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0) << "two held the lease";
  }
  EXPECT_TRUE(Lease::take(path_, "last"));
}

TEST_F(LeaseTest, APipeIsNobodysAndNoneWaitsAtIt) {
  ASSERT_EQ(::mkfifo((path_ + ".1").c_str(), 0600), 0);
  EXPECT_FALSE(Lease::holder(path_));
  EXPECT_TRUE(Lease::take(path_, "a"));
}

TEST_F(LeaseTest, WhatCannotBeReadIsNotFree) {
  if (!RESTAGE_FILES_MAY_RUN_OUT) GTEST_SKIP() << "UBSan needs a free file to look at objects";
  const auto lease = Lease::take(path_, "a");
  {
    const test::Unreadable loop(path_ + ".1");
    EXPECT_THROW(Lease::take(path_, "b"), ReadError);
    EXPECT_THROW(Lease::holder(path_), ReadError);
  }
  {
    const test::NoMoreFiles limit;
    EXPECT_THROW(Lease::holder(path_), ReadError);
  }
  EXPECT_TRUE(Lease::holder(path_));
  EXPECT_FALSE(lease->lost());
}

TEST_F(LeaseTest, AFolderThatIsNotThere) {
  EXPECT_THROW(Lease::take(dir / "none/lease", "a"), InputError);
  EXPECT_FALSE(Lease::holder(dir / "none/lease"));
}

}  // namespace
}  // namespace restage
