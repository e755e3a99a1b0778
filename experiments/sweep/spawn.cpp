#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "autograd/base/atomic_file.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "experiments/sweep/pool.h"

namespace restage::sweep {

namespace {

/// A pipe whose ends no other child inherits.
struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
      throw WorkError(std::string("a process could not be started (") + std::strerror(errno) + ")");
    read = ends[0];
    write = ends[1];
  }
  ~Pipe() {
    close_writer();
    ::close(read);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_writer() {
    if (write >= 0) ::close(write);
    write = -1;
  }
};

/// Shows on standard error what comes, line by line, but the last line that ends a program of ours
/// ("restage: ..."), which is returned without its beginning.
std::string pass_on(int from) {
  const std::string mark = "restage: ";
  std::string line, last;
  char bytes[4096];
  for (ssize_t n = 0; (n = ::read(from, bytes, sizeof bytes)) != 0;) {
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) break;
    for (const char c : std::string_view(bytes, static_cast<size_t>(n))) {
      line += c;
      if (c != '\n') continue;
      if (line.starts_with(mark))
        last = line.substr(mark.size(), line.size() - mark.size() - 1);
      else
        write_all(STDERR_FILENO, line);
      line.clear();
    }
  }
  write_all(STDERR_FILENO, line);  // of a program that died in the middle of it
  return last;
}

}  // namespace

int spawn_self(const std::vector<std::string>& arguments, const std::string& output, bool own_group,
               int errors) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  const bool kept = !output.empty() && [&] {  // a full disk is no reason not to start
    const int fd = ::open(output.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0644);
    if (fd >= 0) ::close(fd);
    return fd >= 0;
  }();
  const char* sink = kept ? output.c_str() : "/dev/null";
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, sink, O_WRONLY | O_APPEND, 0);
  if (errors >= 0)
    posix_spawn_file_actions_adddup2(&files, errors, STDERR_FILENO);
  else if (!output.empty())
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  // A group of its own: Ctrl-C in the terminal reaches us alone, and we pass it on once.
  if (own_group) {
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
  }
  std::vector<std::string> given = words_to_start();
  const std::string program = given.front();
  if (given.size() == 1) given.front() = arguments.front();  // "restage"
  given.insert(given.end(), arguments.begin() + 1, arguments.end());
  std::vector<char*> words;
  for (std::string& word : given) words.push_back(word.data());
  words.push_back(nullptr);
  pid_t pid = 0;
  const int code = posix_spawn(&pid, program.c_str(), &files, &attributes, words.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (code != 0)
    throw WorkError(std::string("a process could not be started (") + std::strerror(code) + ")");
  return pid;
}

void end_with(int pid) {
  // The kernel watches the thread that started us: the one that waits for us until we have ended.
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != pid) ::raise(SIGTERM);
}

void run_self(const std::vector<std::string>& words, const std::string& doing) {
  Pipe errors;
  const int pid = spawn_self(words, "", false, errors.write);
  errors.close_writer();
  const std::string last = pass_on(errors.read);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) throw WorkError("how " + doing + " ended was not told; let SIGCHLD be");
  if (!WIFEXITED(status))
    throw WorkError(doing + " was killed by signal " + std::to_string(WTERMSIG(status)));
  const int code = WEXITSTATUS(status);
  if (code == 0) return;
  if (code == 2 && !last.empty()) throw InputError::of_line(last);
  throw Error(last.empty() ? doing + " ended with exit code " + std::to_string(code) : last, code);
}

void plan_in_a_process(const std::string& dir, const std::vector<std::string>& arguments,
                       bool quiet) {
  std::vector<std::string> words = {
      "restage", "sweep", "plan", "--out", dir, "--threads", std::to_string(threads())};
  if (quiet) words.emplace_back("--quiet");
  words.insert(words.end(), arguments.begin(), arguments.end());
  run_self(words, "planning");
}

}  // namespace restage::sweep
