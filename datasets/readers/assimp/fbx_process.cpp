#include "datasets/readers/assimp/fbx_process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "datasets/readers/assimp/fbx_scene.h"
#include "datasets/readers/errors.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RESTAGE_SANITIZED  // sanitizers reserve terabytes of addresses
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define RESTAGE_SANITIZED
#endif
#endif

namespace restage {
namespace {

constexpr const char* kMend = "export it again, or export GLB (glTF) from Blender";

// What the child answers: this letter, then parts that end in a zero byte, then (kDocument) the
// document.
constexpr char kDocument = 'D', kRefused = 'R', kUnreadable = 'U';

void limit(int resource, rlim_t most) {
  rlimit now{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &now) != 0) return;
  now.rlim_cur = std::min(most, now.rlim_max);
  setrlimit(static_cast<__rlimit_resource>(resource), &now);
}

void set_bounds(size_t content) {
#ifndef RESTAGE_SANITIZED
  const uint64_t memory = (uint64_t{1} << 30) + 64 * uint64_t{content};  // texts need some 30 times
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  limit(RLIMIT_AS, pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) + memory);
#endif
  limit(RLIMIT_CPU, 60 + content / 1000000);  // seconds
  limit(RLIMIT_CORE, 0);
}

std::string answer_of(std::string_view content, const std::string& path) {
  std::string out;
  const auto part = [&](const std::string& text) {
    out += text;
    out += '\0';
  };
  try {
    std::vector<std::string> remarks;
    const std::string glb = fbx_to_glb(content, path, &remarks);
    out = kDocument;
    part(std::to_string(remarks.size()));
    for (const std::string& remark : remarks) part(remark);
    return out + glb;
  } catch (const InputError& error) {
    out = kRefused;
    part(error.what());
  } catch (const std::bad_alloc&) {
    out = kUnreadable;
    part("takes far more memory than a file of its size should");
  } catch (const std::exception& error) {
    out = kUnreadable;
    part(cat("cannot be read (", assimp_words(error.what()), ")"));
  }
  return out;
}

/// Sockets and files of the program are no business of the child's.
void close_all_but(int kept) {
  std::vector<int> open;
  std::error_code error;
  for (const auto& one : std::filesystem::directory_iterator("/proc/self/fd", error))
    open.push_back(std::atoi(one.path().filename().c_str()));
  for (const int fd : open)
    if (fd > STDERR_FILENO && fd != kept) close(fd);
}

[[noreturn]] void work(int to, std::string_view content, const std::string& path) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU, SIGTERM, SIGINT})
    std::signal(signal, SIG_DFL);
  const int nowhere =
      open("/dev/null", O_WRONLY);  // what abort() and alike say is said by the parent
  if (nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  close_all_but(to);
  set_bounds(content.size());
  const std::string answer = answer_of(content, path);
  for (size_t at = 0; at < answer.size();) {
    const ssize_t n = write(to, answer.data() + at, answer.size() - at);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) _exit(1);
    at += static_cast<size_t>(n);
  }
  _exit(0);
}

std::string all_of(int from) {
  std::string out;
  std::vector<char> block(1 << 16);
  while (true) {
    const ssize_t n = read(from, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return out;
    out.append(block.data(), static_cast<size_t>(n));
  }
}

/// Takes the next part off the answer.
std::string next_part(std::string_view& answer) {
  const size_t end = std::min(answer.find('\0'), answer.size());
  std::string out(answer.substr(0, end));
  answer.remove_prefix(std::min(end + 1, answer.size()));
  return out;
}

}  // namespace

std::string fbx_in_a_process(std::string_view content, const std::string& path,
                             std::vector<std::string>* remarks) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw WorkError(path + ": no pipe to its reader can be made");
  const pid_t child = fork();
  if (child == 0) work(ends[1], content, path);
  close(ends[1]);
  const std::string all = child < 0 ? "" : all_of(ends[0]);
  close(ends[0]);
  if (child < 0) throw WorkError(path + ": no process can be started that reads it");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (all.empty() || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (signal == SIGKILL || signal == SIGTERM || signal == SIGINT)
      throw WorkError(path +
                      ": its reader was stopped from outside, as a machine without memory does");
    throw InputError(path,
                     signal == SIGXCPU ? "takes far longer to read than a file of its size should"
                                       : "is so broken that its reader crashed",
                     kMend);
  }
  std::string_view answer(all);
  answer.remove_prefix(1);
  if (all[0] == kRefused) {
    const std::string text = next_part(answer);  // "file: what is wrong; mend"
    const size_t at = text.rfind("; ");
    throw InputError("", text.substr(0, at), text.substr(at + 2));
  }
  if (all[0] == kUnreadable) throw InputError(path, next_part(answer), kMend);
  const size_t count = std::stoul(next_part(answer));
  for (size_t i = 0; i < count; ++i) {
    std::string remark = next_part(answer);
    if (remarks != nullptr) remarks->push_back(std::move(remark));
  }
  return std::string(answer);
}

}  // namespace restage
