#include "experiments/cli/pictures/browser.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include "autograd/base/error.h"
#include "datasets/readers/file_sums.h"

namespace restage::cli {
namespace {

/// The exit code of a child of ours, if it ends within some seconds; nothing while it works on, and
/// where the system keeps no codes.
std::optional<int> early_code(pid_t child) {
  constexpr int kLooks = 100;
  for (int look = 0; look < kLooks; ++look) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    if (ended < 0 && errno != EINTR) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return std::nullopt;
}

}  // namespace

void open_page(const std::string& page) {
  std::string program = "xdg-open", place = page;
  char* words[] = {program.data(), place.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t how;
  posix_spawnattr_init(&how);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSID);
  pid_t pid = 0;
  const int code = posix_spawnp(&pid, "xdg-open", &files, &how, words, environ);
  posix_spawnattr_destroy(&how);
  posix_spawn_file_actions_destroy(&files);
  if (code != 0 || early_code(pid).value_or(0) != 0)
    throw WorkError(page + ": no program opened the page; open it in a browser");
}

void check_display() {
  const auto is_set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY"))
    throw InputError("", "there is no display to show the page on",
                     "write a file: --out picture.png, animation.webp or page.html");
}

std::string page_for(const std::string& file) {
  namespace fs = std::filesystem;
  const std::string cache = user_cache(), folder = cache + "/view";
  std::error_code error;
  if (!cache.empty()) fs::create_directories(folder, error);
  if (cache.empty() || error)
    throw WorkError("no folder for the page can be made; give --out page.html");
  const auto day_before = fs::file_time_type::clock::now() - std::chrono::hours(24);
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::file_time_type written = entry.last_write_time(error);
    if (!error && written < day_before) fs::remove(entry.path(), error);
  }
  const std::string stem = fs::path(file).filename().stem().string();
  return folder + "/" + (stem.empty() ? "view" : stem) + ".html";
}

}  // namespace restage::cli
