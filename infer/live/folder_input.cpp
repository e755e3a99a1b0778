#include "infer/live/folder_input.h"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "autograd/base/error.h"

namespace restage::live {
namespace {

constexpr int kRound = 100;  // milliseconds between looks at what may be given up or come back
constexpr std::chrono::milliseconds kPatience{500};

class FolderWatch {
 public:
  FolderWatch(const std::string& folder, const FolderFiles& files, Mailbox& to, Words& words)
      : folder_(folder),
        files_(files),
        to_(to),
        words_(words),
        inotify_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
    if (inotify_ < 0) throw WorkError("the system has no more room to watch folders");
  }
  ~FolderWatch() { close(inotify_); }
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

  void run(int stop) {
    for (;;) {
      if (watch_ < 0) begin();
      pollfd all[] = {{stop, POLLIN, 0}, {inotify_, POLLIN, 0}};
      const int ready = poll(all, 2, kRound);
      if (ready > 0 && all[0].revents != 0) return;
      if (ready > 0) take(events());
      if (tried_ && Clock::now() - tried_->when > kPatience) give_up();
    }
  }

 private:
  /// Watches the folder and takes what is there already.
  void begin() {
    watch_ = inotify_add_watch(
        inotify_, folder_.c_str(),
        IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR);
    if (watch_ < 0) {
      words_.warn("folder", folder_ + " is not there any more; the stream waits for it");
      return;
    }
    std::vector<std::string> names;
    std::error_code gone;
    for (std::filesystem::directory_iterator file(folder_, gone), end; !gone && file != end;
         file.increment(gone))
      names.push_back(file->path().filename().string());
    take(std::move(names));
    listed_ = taken_;
  }

  /// What tells a file from the same one written again; nothing if it is not there.
  std::optional<std::pair<std::string, std::filesystem::file_time_type>> mark_of(
      const std::string& path) const {
    std::error_code gone;
    const auto time = std::filesystem::last_write_time(path, gone);
    return gone ? std::nullopt : std::optional(std::pair(path, time));
  }

  /// Names of the files that have come since; none if the folder has gone.
  std::vector<std::string> events() {
    alignas(inotify_event) char buffer[1 << 14];
    std::vector<std::string> names;
    for (ssize_t got; (got = read(inotify_, buffer, sizeof buffer)) > 0;)
      for (const char* at = buffer; at < buffer + got;) {
        const auto& event = *reinterpret_cast<const inotify_event*>(at);
        at += sizeof event + event.len;
        if ((event.mask & (IN_DELETE_SELF | IN_MOVE_SELF)) != 0 && event.wd == watch_) {
          inotify_rm_watch(inotify_, watch_);
          watch_ = -1;
        } else if (event.len > 0) {
          names.emplace_back(event.name);
        }
      }
    return names;
  }

  void take(std::vector<std::string> names) {
    std::erase_if(names, [&](const std::string& name) { return !files_.is_cloud(name); });
    if (names.empty()) return;
    const Clock::time_point now = Clock::now();
    std::sort(names.begin(), names.end(), files_.before);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    if (tried_ && tried_->name != names.back()) {
      if (std::find(names.begin(), names.end(), tried_->name) == names.end()) give_up();
      tried_.reset();
    }
    cloud_.name = folder_ + (folder_.ends_with('/') ? "" : "/") + names.back();
    taken_ = mark_of(cloud_.name);
    // A file that was closed while begin() looked is in its list, and is told of, too.
    if (listed_ && std::exchange(listed_, std::nullopt) == taken_) return;
    to_.pass(static_cast<int64_t>(names.size()) - 1);
    cloud_.arrived = now;
    cloud_.seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
    cloud_.sender = 1;
    int64_t before = 0;
    try {
      before = files_.read(cloud_.name, cloud_);
    } catch (const std::exception& fault) {
      if (!tried_) tried_ = Tried{names.back(), fault.what(), now};
      tried_->why = fault.what();
      return;
    }
    tried_.reset();
    if (before > 0)
      words_.warn("many clouds", cloud_.name + " holds " + std::to_string(before + 1) +
                                     " clouds, and the last is taken; write one cloud a file");
    to_.pass(before);
    to_.put(cloud_);
  }

  void give_up() {
    to_.refuse();
    words_.warn("refused", "left out: " + tried_->why);
    tried_.reset();
  }

  const std::string& folder_;
  const FolderFiles& files_;
  Mailbox& to_;
  Words& words_;
  int inotify_, watch_ = -1;
  LiveCloud cloud_;
  struct Tried {
    std::string name, why;
    Clock::time_point when;
  };
  /// The file that was read last, and that of begin() until another one comes.
  std::optional<std::pair<std::string, std::filesystem::file_time_type>> taken_, listed_;
  std::optional<Tried> tried_;  ///< a file that could not be read, perhaps only yet
};

}  // namespace

void FolderInput::run(int stop, Mailbox& to, Words& words) {
  FolderWatch(folder_, files_, to, words).run(stop);
}

}  // namespace restage::live
