#include "experiments/sweep/pool.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <fstream>
#include <set>
#include <thread>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"

namespace restage::sweep {

using tables::TrialState;
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kNap = std::chrono::milliseconds(20);
constexpr auto kLook = std::chrono::seconds(1);       // at the folder: requests, other engines
constexpr auto kPatience = std::chrono::seconds(30);  // with a heartbeat on another host

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One trial as this pool sees it.
struct Slot {
  enum class State { waiting, running, elsewhere, done, failed, stopped, early };
  State state = State::waiting;
  const TrialEntry* trial = nullptr;
  int pid = 0, failures = 0;
  Clock::time_point started;
  // Elsewhere: the last heartbeat that was seen, and when it changed.
  int64_t beat = -1;
  Clock::time_point beat_seen;
};

/// When memory is short the kernel should end a trial, not us.
void offer_to_the_kernel(int pid) {
  std::ofstream("/proc/" + std::to_string(pid) + "/oom_score_adj") << 500;
}

std::string how_it_ended(int status, const std::string& last) {
  std::string out;
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    out = "killed by signal " + std::to_string(number) + " (" + ::strsignal(number) + ")";
    if (number == SIGKILL) out += ", by somebody or for want of memory";
  } else {
    out = "ended with code " + std::to_string(WEXITSTATUS(status)) + " and left no result";
  }
  return last.empty() ? out : out + "; its last line: " + last;
}

class Pool {
 public:
  Pool(const SweepDir& dir, const PoolOptions& options)
      : dir_(dir), options_(options), token_(stop_token(dir.path)), asks_(options.ask != nullptr) {
    for (const TrialEntry& trial : dir.trials) add(trial);
  }

  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  /// After an error no trial may go on that nobody judges.
  ~Pool() {
    terminate();
    for (const Slot& slot : slots_)
      if (slot.pid > 0) ::waitpid(slot.pid, nullptr, 0);
  }

  PoolOutcome run() {
    while (true) {
      reap();
      if (Clock::now() >= look_) look();
      const bool ending = stop_requested() || outcome_.stop_requested;
      if (ending) terminate();
      if (!ending && changed_) start_what_is_ready();
      if (!ending && asks_ && running_ < options_.jobs && !has(Slot::State::waiting)) {
        ask();
        continue;
      }
      if (running_ == 0 && (ending || (!has(Slot::State::waiting) && !has(Slot::State::elsewhere))))
        break;
      std::this_thread::sleep_for(kNap);
    }
    throw_if_stopped();
    for (const Slot& slot : slots_) {
      if (slot.state == Slot::State::done || slot.state == Slot::State::early)
        tidy(dir_, slot.trial->id);
      outcome_.done += slot.state == Slot::State::done;
      outcome_.failed += slot.state == Slot::State::failed;
      outcome_.stopped += slot.state == Slot::State::stopped;
      outcome_.stopped_early += slot.state == Slot::State::early;
      outcome_.pending +=
          slot.state == Slot::State::waiting || slot.state == Slot::State::elsewhere;
    }
    return outcome_;
  }

 private:
  void add(const TrialEntry& trial) {
    Slot slot;
    slot.trial = &trials_.emplace_back(trial);
    slot.state = over(trial).value_or(Slot::State::waiting);
    slots_.push_back(slot);
  }
  void ask() {
    const std::vector<TrialEntry> more = options_.ask();
    for (const TrialEntry& trial : more) add(trial);
    asks_ = !more.empty();
    changed_ = true;
  }

  /// The state of a trial with nothing left to do.
  std::optional<Slot::State> over(const TrialEntry& trial) const {
    const auto result = read_result(dir_, trial.id);
    if (!result || !is_over(dir_, *result)) return std::nullopt;
    return result->state == TrialState::done ? Slot::State::done : Slot::State::early;
  }
  bool has(Slot::State state) const {
    return std::any_of(slots_.begin(), slots_.end(),
                       [&](const Slot& slot) { return slot.state == state; });
  }
  std::string name(const Slot& slot) const {
    std::string out = "trial " + slot.trial->id + " (";
    if (!slot.trial->case_name.empty()) out += slot.trial->case_name + ", ";
    for (const auto& [key, value] : slot.trial->overrides) out += key + "=" + value.dump() + ", ";
    return out + "seed " + std::to_string(slot.trial->seed) + ")";
  }

  // ---- starting ----

  /// Artifacts that running trials are about to make.
  std::set<std::string> being_made() const {
    std::set<std::string> out;
    for (const Slot& slot : slots_)
      if (slot.state == Slot::State::running)
        for (const auto& [stage, id] : slot.trial->artifacts)
          if (!artifact_there(dir_.store, stage, id)) out.insert(stage + "-" + id);
    return out;
  }
  void start_what_is_ready() {
    changed_ = false;
    if (running_ >= options_.jobs || !has(Slot::State::waiting)) return;
    std::set<std::string> made = being_made();
    for (Slot& slot : slots_) {
      if (running_ >= options_.jobs) return;
      if (slot.state != Slot::State::waiting) continue;
      const auto& needed = slot.trial->artifacts;
      if (std::any_of(needed.begin(), needed.end(), [&](const auto& artifact) {
            return made.contains(artifact.first + "-" + artifact.second);
          }))
        continue;
      start(slot);
      if (slot.state != Slot::State::running) continue;
      for (const auto& [stage, id] : needed)
        if (!artifact_there(dir_.store, stage, id)) made.insert(stage + "-" + id);
    }
  }
  void start(Slot& slot) {
    if (const auto state = over(*slot.trial)) {
      slot.state = *state;
      return;
    }
    if (Lease::holder(dir_.lease(slot.trial->id)) && slot.beat < 0) {
      leave_to_others(slot);
      return;
    }
    slot.pid =
        spawn_self({"restage", "trial", dir_.path, slot.trial->id, "--threads",
                    std::to_string(options_.threads), "--ends-with", std::to_string(::getpid())},
                   dir_.log(slot.trial->id), true);
    offer_to_the_kernel(slot.pid);
    slot.state = Slot::State::running;
    slot.started = Clock::now();
    ++running_;
    log_info(name(slot) + " started");
  }

  // ---- ending ----

  void reap() {
    for (Slot& slot : slots_) {
      if (slot.state != Slot::State::running) continue;
      int status = 0;
      if (::waitpid(slot.pid, &status, WNOHANG) != slot.pid) continue;
      --running_;
      changed_ = true;
      slot.pid = 0;
      judge(slot, status);
    }
  }
  void judge(Slot& slot, int status) {
    const auto result = read_result(dir_, slot.trial->id);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    if (const auto state = over(*slot.trial)) {
      end(slot, *state, "");
    } else if (Lease::holder(dir_.lease(slot.trial->id))) {
      slot.beat = -1;
      leave_to_others(slot);
    } else if ((result && result->state == TrialState::stopped) || code == 128 + SIGTERM ||
               code == 128 + SIGINT || terminated_) {
      end(slot, Slot::State::stopped, "");
    } else if (result && result->state == TrialState::failed) {
      failed(slot, result->error, false);
    } else {
      failed(slot, how_it_ended(status, last_line(dir_.log(slot.trial->id))), true);
    }
  }
  void failed(Slot& slot, const std::string& error, bool record) {
    if (record) write_failure(slot, error);
    if (++slot.failures <= dir_.retries) {
      log_warning(name(slot) + " failed and is tried again: " + error);
      slot.state = Slot::State::waiting;
    } else {
      end(slot, Slot::State::failed, error);
    }
  }
  /// A trial that was killed cannot say so itself.
  void write_failure(const Slot& slot, const std::string& error) {
    try {
      const auto lease = Lease::take(dir_.lease(slot.trial->id), "the pool", {});
      if (!lease || read_result(dir_, slot.trial->id)) return;
      write_result(dir_, *slot.trial, TrialState::failed, error, {}, seconds_since(slot.started));
    } catch (const Error& why) {
      log_warning(why.what());
    }
  }
  void end(Slot& slot, Slot::State state, const std::string& error) {
    slot.state = state;
    char time[32];
    std::snprintf(time, sizeof time, "%.1f s", seconds_since(slot.started));
    if (state == Slot::State::done) log_info(name(slot) + " done in " + time);
    if (state == Slot::State::stopped) log_info(name(slot) + " stopped");
    if (state == Slot::State::early) log_info(name(slot) + " stopped early");
    if (state == Slot::State::failed) log_warning(name(slot) + " failed: " + error);
  }
  /// A signal is passed on once; a trial writes a checkpoint and ends.
  void terminate() {
    if (terminated_) return;
    terminated_ = true;
    for (const Slot& slot : slots_)
      if (slot.pid > 0) ::kill(slot.pid, SIGTERM);
  }

  // ---- others ----

  void leave_to_others(Slot& slot) {
    if (slot.state != Slot::State::elsewhere) {
      const auto holder = Lease::holder(dir_.lease(slot.trial->id));
      log_info(name(slot) + " is left to " + (holder ? holder->text() : "others"));
    }
    slot.state = Slot::State::elsewhere;
    slot.beat_seen = Clock::now();
  }
  void look() {
    look_ = Clock::now() + kLook;
    changed_ = true;
    if (stop_token(dir_.path) != token_) outcome_.stop_requested = true;
    for (Slot& slot : slots_)
      if (slot.state == Slot::State::elsewhere) look_at(slot);
  }
  void look_at(Slot& slot) {
    const auto holder = Lease::holder(dir_.lease(slot.trial->id));
    if (const auto state = over(*slot.trial)) {
      end(slot, *state, "");
    } else if (!holder) {
      slot.beat = -1;
      slot.state = Slot::State::waiting;
    } else if (holder->here || holder->beat != slot.beat) {
      slot.beat = holder->beat;
      slot.beat_seen = Clock::now();
    } else if (Clock::now() - slot.beat_seen > kPatience) {
      slot.state = Slot::State::waiting;  // the trial that is started will make sure
    }
  }

  const SweepDir& dir_;
  const PoolOptions options_;
  const std::string token_;        ///< of requests to stop, as it was when we began
  std::deque<TrialEntry> trials_;  ///< of the slots
  std::vector<Slot> slots_;
  PoolOutcome outcome_;
  int running_ = 0;
  bool changed_ = true;  ///< something may be ready
  bool asks_;            ///< there may be more trials than there are
  bool terminated_ = false;
  Clock::time_point look_ = Clock::now() + kLook;
};

}  // namespace

PoolOutcome run_pool(const SweepDir& dir, const PoolOptions& options) {
  return Pool(dir, options).run();
}

}  // namespace restage::sweep
