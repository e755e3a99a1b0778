#include "autograd/base/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"

namespace restage {
namespace {

constexpr int kAskEvery = 100;  // milliseconds from one question for a wish to stop to the next

// The child writes how it ended: one of these letters, and after kAnswered the answer's size and
// bytes. The status that waitpid() gives would not do: a host that ignores SIGCHLD, or that waits
// for all children, takes it away.
constexpr char kAnswered = 'A', kCrashed = 'C', kNoMemory = 'M', kNoEnd = 'T';

// The child is a copy of one thread. A lock that another thread held at that moment is never opened
// in the copy: allocators of sanitizers and libraries have such locks, and some burn time while
// they wait. So the first child that finds no end is replaced by a second one where there are other
// threads, and a first one that only waits has no more than these seconds.
constexpr unsigned kFirstClock = 10;

int to_parent = -1;  // in the child

void write_all(const void* data, size_t size) {
  for (const char* at = static_cast<const char*>(data); size > 0;) {
    const ssize_t n = ::write(to_parent, at, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(1);
    at += n;
    size -= static_cast<size_t>(n);
  }
}

[[noreturn]] void end_as(char letter) {
  write_all(&letter, 1);
  ::_exit(0);
}

void on_crash(int) { end_as(kCrashed); }
void on_time(int) { end_as(kNoEnd); }

unsigned clock_limit = 0;  // seconds
double worked_before = 0;  // seconds of processor time at the last alarm

/// A busy machine may let the child wait for long. It is ended by the clock if it hardly works.
void on_alarm(int) {
  constexpr double kWorks = 0.01;  // of the time by the clock
  timespec used{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  const double worked = static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  if (worked - worked_before < kWorks * clock_limit) end_as(kNoEnd);
  worked_before = worked;
  ::alarm(clock_limit);
}

void set_signals() {
  static char stack[1 << 16];  // for what overflows its own
  const stack_t other{stack, 0, sizeof stack};
  ::sigaltstack(&other, nullptr);
  const auto set = [](std::initializer_list<int> signals, void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = SA_ONSTACK | SA_RESTART;
    for (const int signal : signals) ::sigaction(signal, &action, nullptr);
  };
  set({SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGPIPE}, SIG_IGN);
  set({SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL}, on_crash);
  set({SIGXCPU}, on_time);
  set({SIGALRM}, on_alarm);
  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
}

/// Bytes of address space in use.
rlim_t address_space() {
  char text[64] = {};
  const int fd = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const ssize_t n = fd < 0 ? -1 : ::read(fd, text, sizeof text - 1);
  ::close(fd);
  return n <= 0 ? 0
                : std::strtoul(text, nullptr, 10) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

void bound(decltype(RLIMIT_AS) what, rlim_t soft, rlim_t hard) {
  rlimit both{};
  if (::getrlimit(what, &both) != 0) return;
  both = {std::min(soft, both.rlim_max), std::min(hard, both.rlim_max)};
  ::setrlimit(what, &both);
}

void set_limits(const ChildLimits& limits) {
  bound(RLIMIT_CORE, 0, 0);
  bound(RLIMIT_CPU, limits.seconds, limits.seconds + 1);  // SIGXCPU first, then SIGKILL
  if (const rlim_t used = address_space(); used > 0)
    bound(RLIMIT_AS, used + limits.memory, used + limits.memory);
  clock_limit = limits.clock;
  ::alarm(limits.clock);
}

[[noreturn]] void child(const ChildLimits& limits, const std::function<std::string()>& work) {
  set_signals();
  const int nowhere = ::open("/dev/null", O_WRONLY);  // what abort() says, too
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    if (nowhere >= 0) ::dup2(nowhere, stream);
  set_limits(limits);
  std::string answer;
  try {
    answer = work();
  } catch (const std::bad_alloc&) {
    end_as(kNoMemory);
  } catch (...) {
    end_as(kCrashed);
  }
  ::signal(SIGXCPU, SIG_IGN);  // no letter may fall into the answer
  ::alarm(0);
  const uint64_t size = answer.size();
  write_all(&kAnswered, 1);
  write_all(&size, sizeof size);
  write_all(answer.data(), answer.size());
  ::_exit(0);
}

/// The end of a pipe, closed with this object.
struct End {
  explicit End(int which) : fd(which) {}
  ~End() { ::close(fd); }
  End(const End&) = delete;
  End& operator=(const End&) = delete;
  int fd;
};

/// The child's status; nothing where the host took it.
int status_of(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) return SIGKILL;
  return status;
}

constexpr size_t kHead = 1 + sizeof(uint64_t);

/// Of the answer that begins with `said`, read at least as far as the head.
uint64_t size_of(const std::string& said) {
  uint64_t size = 0;
  std::memcpy(&size, said.data() + 1, sizeof size);
  return size;
}

bool is_whole(const std::string& said) {
  return said[0] != kAnswered || (said.size() >= kHead && said.size() - kHead >= size_of(said));
}

/// What the child writes. The pipe may be open in another thread's child, so its end may come late.
std::string read_all(int from, pid_t pid) {
  const bool asked_before = stop_requested();  // by somebody who is being answered
  std::string out;
  std::vector<char> block(1 << 16);
  while (true) {
    pollfd one{from, POLLIN, 0};
    if (::poll(&one, 1, kAskEvery) <= 0) {
      if (asked_before || !stop_requested()) continue;
      ::kill(pid, SIGKILL);
      status_of(pid);
      throw_if_stopped();
    }
    const ssize_t n = ::read(from, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return out;
    out.append(block.data(), static_cast<size_t>(n));
    if (is_whole(out)) return out;
  }
}

ChildResult result_of(const std::string& said, int status, const std::string& where) {
  using enum ChildResult::End;
  const char letter = said.empty() ? '\0' : said[0];
  if (letter == kCrashed) return {crashed, ""};
  if (letter == kNoMemory) return {no_memory, ""};
  if (letter == kNoEnd) return {no_end, ""};
  if (letter == kAnswered && is_whole(said)) return {answered, said.substr(kHead)};
  if (WIFEXITED(status)) return {crashed, ""};
  throw WorkError(where +
                  ": the process that reads it was killed, as a machine without memory does; "
                  "run it again");
}

bool has_other_threads() {
  std::error_code fault;
  std::filesystem::directory_iterator task("/proc/self/task", fault);
  return !fault && std::distance(task, {}) > 1;
}

ChildResult in_one_child(const ChildLimits& limits, const std::string& where,
                         const std::function<std::string()>& work) {
  const auto refuse = [&]() -> WorkError {
    return WorkError(where + ": no process to read it in could be started (" +
                     std::strerror(errno) + "); end some others");
  };
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw refuse();
  const End from(ends[0]);
  sigset_t all, before;
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);  // no handler of ours runs in the child
  const pid_t parent = ::getpid(), pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    to_parent = ends[1];
    ::close(ends[0]);
    child(limits, work);
  }
  const int fault = errno;
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ::close(ends[1]);
  if (errno = fault; pid < 0) throw refuse();
  const std::string said = read_all(from.fd, pid);
  return result_of(said, status_of(pid), where);
}

}  // namespace

ChildResult in_a_child(const ChildLimits& limits, const std::string& where,
                       const std::function<std::string()>& work) {
  if (!has_other_threads()) return in_one_child(limits, where, work);
  const ChildLimits first{limits.memory, limits.seconds, std::min(limits.clock, kFirstClock)};
  ChildResult result = in_one_child(first, where, work);
  if (result.end == ChildResult::End::no_end) result = in_one_child(limits, where, work);
  return result;
}

}  // namespace restage
