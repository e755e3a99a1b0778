#include "train/lease.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/host.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

/// A record is one text of this size, so that a heartbeat replaces it at one blow.
constexpr size_t kRecord = 1024;
constexpr int kTries = 1000;
constexpr const char* kDraft = ".part";  ///< as name_beside() has it

std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// Where process numbers mean the same: the running kernel and the process namespace.
const std::string& process_world() {
  static const std::string world = [] {
    char name[64] = "";
    const ssize_t n = ::readlink("/proc/self/ns/pid", name, sizeof name - 1);
    return first_line("/proc/sys/kernel/random/boot_id") + "/" +
           std::string(name, n > 0 ? static_cast<size_t>(n) : 0);
  }();
  return world;
}

/// Ticks from the boot to the start of a process: "" if that cannot be seen, "dead" if it is dead
/// and not yet buried by its parent. After the name, which may hold anything, the state is the
/// first word and the start time the 20th.
std::string start_of(int64_t pid) {
  const std::string line = first_line("/proc/" + std::to_string(pid) + "/stat");
  const size_t name_end = line.rfind(')');
  if (name_end == std::string::npos || name_end + 2 >= line.size()) return "";
  const char state = line[name_end + 2];
  if (state == 'Z' || state == 'X') return "dead";
  size_t at = name_end + 2;
  for (int word = 1; word < 20 && at != std::string::npos; ++word) at = line.find(' ', at) + 1;
  return line.substr(at, line.find(' ', at) - at);
}

/// Whether process `pid` of this host lives and is the one that started at `start`.
bool runs(int64_t pid, const std::string& start) {
  const std::string now = start_of(pid);
  if (now.empty() || start.empty())  // /proc shows nothing, perhaps of another user
    return ::kill(static_cast<pid_t>(pid), 0) == 0 || errno == EPERM;
  return now == start;
}

}  // namespace

/// What a lease's file says. Named, not anonymous: Lease::State has one.
struct LeaseRecord {
  LeaseHolder holder;
  std::string world, start, token;
  bool released = false;

  /// The record as `kRecord` bytes, in which everything that changes has a fixed place: who reads
  /// in the middle of a heartbeat sees no broken text.
  std::string text() const {
    const nlohmann::ordered_json json = {{"host", holder.host}, {"pid", holder.pid},
                                         {"who", holder.who},   {"start", start},
                                         {"world", world},      {"token", token}};
    std::string out = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    out.back() = ' ';
    out += format(",\"released\":%d,\"beat\":%20lld}", released ? 1 : 0,
                  static_cast<long long>(holder.beat));
    out.resize(kRecord - 1, ' ');
    return out + "\n";
  }
};

namespace {
std::string numbered(const std::string& path, int64_t number) {
  return path + "." + std::to_string(number);
}

/// The first bytes of a file, none of a pipe; nothing: no such file. ReadError if they cannot be
/// had: somebody may hold the lease.
std::optional<std::string> read_bytes(const std::string& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    const ReadError error(file, errno);
    if (error.absent()) return std::nullopt;
    throw error;
  }
  std::string bytes(kRecord, ' ');
  const ssize_t n = ::pread(fd, bytes.data(), bytes.size(), 0);
  ::close(fd);
  bytes.resize(n > 0 ? static_cast<size_t>(n) : 0);
  return bytes;
}

/// The record of a file; nothing if there is no such file. A file that stays unreadable for a while
/// is damaged, and its record belongs to nobody.
std::optional<LeaseRecord> read_record(const std::string& file) {
  constexpr int kLooks = 10;
  nlohmann::json json;
  for (int look = 0; look < kLooks && !json.is_object(); ++look) {
    if (look > 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const std::optional<std::string> bytes = read_bytes(file);
    if (!bytes) return std::nullopt;
    json = nlohmann::json::parse(*bytes, nullptr, false);
  }
  LeaseRecord out;
  const auto text = [&](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto number = [&](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_number_integer() ? found->get<int64_t>() : 0;
  };
  if (!json.is_object()) {
    out.released = true;
    return out;
  }
  out.holder = {text("host"), text("who"), number("pid"), number("beat"),
                text("world") == process_world()};
  out.world = text("world");
  out.start = text("start");
  out.token = text("token");
  out.released = number("released") != 0;
  return out;
}

/// What follows `path` and `mark` in the names of the files beside it. ReadError if the folder is
/// there and cannot be read.
std::vector<std::string> ends_of_names(const std::string& path, const char* mark) {
  const fs::path parent = fs::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  const std::string prefix = fs::path(path).filename().string() + mark;
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with(prefix)) out.push_back(name.substr(prefix.size()));
  }
  if (error && is_there(folder)) throw ReadError(folder, error.value());
  return out;
}

/// The highest number of the files of a lease; 0 if it has no files.
int64_t last_number(const std::string& path) {
  int64_t last = 0;
  for (const std::string& name : ends_of_names(path, ".")) {
    int64_t number = 0;
    const char* stop = name.data() + name.size();
    const auto found = std::from_chars(name.data(), stop, number);
    if (found.ec == std::errc() && found.ptr == stop) last = std::max(last, number);
  }
  return last;
}

/// Whether a lease is free, as far as that is known at once: it says so, or its holder was a
/// process of this host and is dead.
bool surely_free(const LeaseRecord& record) {
  if (record.released) return true;
  return record.holder.here && !runs(record.holder.pid, record.start);
}

/// Writes the file of a lease that this process wants to take, under a name that nobody else uses.
std::string draft(const std::string& path, const LeaseRecord& record) {
  const std::string name = name_beside(path);
  const int fd = ::open(name.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
  if (fd < 0) throw_unwritable(path, errno);
  const std::string text = record.text();
  const bool good = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                    ::fsync(fd) == 0;
  const int code = good ? 0 : errno;
  ::close(fd);
  if (good) return name;
  ::unlink(name.c_str());
  throw_unwritable(path, code == 0 ? ENOSPC : code);
}

/// Removes the drafts of processes that were killed before they could do so themselves.
void remove_dead_drafts(const std::string& path) {
  try {
    for (const std::string& token : ends_of_names(path, kDraft)) {
      const std::string name = path + kDraft + token;
      const std::optional<LeaseRecord> record = read_record(name);
      if (record && surely_free(*record)) ::unlink(name.c_str());
    }
  } catch (const ReadError&) {  // left to whoever tidies up next
  }
}

/// Gives a file one more name, which only one process can do. A network file system may give the
/// name and answer that it failed: the number of the file's names tells.
bool link_once(const std::string& from, const std::string& to) {
  if (::link(from.c_str(), to.c_str()) == 0) return true;
  const int code = errno;
  struct stat found {};
  if (::stat(from.c_str(), &found) == 0 && found.st_nlink == 2) return true;
  errno = code;
  return false;
}

/// Waits until the heartbeat of the holder in `file` moves (true), or does not for `patience`. Time
/// in which we ourselves stood still (a stalled file system, a suspended process) does not count.
bool beats(const std::string& file, const LeaseRecord& record, double patience) {
  const double nap = std::clamp(patience / 20, 0.01, 1.0);
  for (double waited = 0; waited < patience;) {
    const auto before = Clock::now();
    std::this_thread::sleep_for(Seconds(nap));
    const std::optional<LeaseRecord> now = read_record(file);
    if (!now || now->released) return false;
    if (now->token != record.token || now->holder.beat != record.holder.beat) return true;
    waited += std::min(Seconds(Clock::now() - before).count(), 2 * nap);
  }
  return false;
}

}  // namespace

std::string LeaseHolder::text() const {
  return "process " + std::to_string(pid) + " on host " + host + " (" + who + ")";
}

struct Lease::State {
  std::string path, file;
  int64_t number = 0;
  LeaseRecord record;
  LeaseOptions options;
  std::atomic<bool> lost = false;
  std::mutex mutex;
  std::condition_variable wake;
  bool held = false, ending = false, forgotten = false;
  std::thread thread;

  /// Whether somebody linked the next number, or removed our file after finishing the work.
  bool superseded() const {
    return ::access(numbered(path, number + 1).c_str(), F_OK) == 0 ||
           ::access(file.c_str(), F_OK) != 0;
  }
  /// Writes the record over the old one, so that a full disk needs no new block. False if the file
  /// could not be written.
  bool write() {
    const int fd = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) return false;
    const std::string text = record.text();
    const bool good =
        ::pwrite(fd, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
    return ::close(fd) == 0 && good;
  }
  void beat_until_end() {
    auto written = Clock::now();
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, Seconds(options.beat), [&] { return ending; })) {
      lock.unlock();
      bool good = false;
      try {
        ++record.holder.beat;
        if (superseded()) lost = true;
        good = !lost && write();
        if (options.on_beat) options.on_beat();
      } catch (...) {  // there is no memory, which the work will find out by itself
      }
      if (good) written = Clock::now();
      // From then on others may take this process for dead.
      if (Seconds(Clock::now() - written).count() > options.patience / 2) lost = true;
      lock.lock();
    }
  }
  ~State() {
    {
      const std::lock_guard lock(mutex);
      ending = true;
    }
    wake.notify_all();
    if (thread.joinable()) thread.join();
    if (!held || forgotten || superseded()) return;
    record.released = true;
    write();
  }
};

std::optional<Lease> Lease::take(const std::string& path, const std::string& who,
                                 LeaseOptions options) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->options = std::move(options);
  state->record.holder = {host_name(), who.substr(0, 200), ::getpid(), 0, true};
  state->record.world = process_world();
  state->record.start = start_of(::getpid());
  state->record.token = unique_token();
  const std::string name = draft(path, state->record);
  struct Remove {
    const std::string& name;
    ~Remove() { ::unlink(name.c_str()); }
  } const remove{name};

  int64_t number = last_number(path);
  for (int i = 0; i < kTries; ++i) {
    if (const auto now = read_record(numbered(path, number)); number > 0 && now) {
      if (!surely_free(*now)) {
        if (now->holder.here) return std::nullopt;
        if (beats(numbered(path, number), *now, state->options.patience)) return std::nullopt;
        if (const auto later = last_number(path); later > number) {
          number = later;
          continue;
        }
      }
    }
    state->number = number + 1;
    state->file = numbered(path, state->number);
    if (link_once(name, state->file)) {
      if (last_number(path) > state->number) {  // other holders have come and gone in the meantime
        ::unlink(state->file.c_str());
        number = last_number(path);
        continue;
      }
      state->held = true;
      state->thread = std::thread([raw = state.get()] { raw->beat_until_end(); });
      return Lease(std::move(state));
    }
    if (errno != EEXIST) throw_unwritable(path, errno);
    number = std::max(number + 1, last_number(path));
  }
  throw WorkError(path + ": the lease changes hands all the time; try again later");
}

std::optional<LeaseHolder> Lease::holder(const std::string& path) {
  const int64_t number = last_number(path);
  if (number == 0) return std::nullopt;
  const auto record = read_record(numbered(path, number));
  if (!record || surely_free(*record)) return std::nullopt;
  return record->holder;
}

Lease::Lease(std::unique_ptr<State> state) : state_(std::move(state)) {}
Lease::Lease(Lease&&) noexcept = default;
Lease::~Lease() = default;

bool Lease::lost() const { return state_->lost || state_->superseded(); }

void Lease::forget() {
  state_->forgotten = true;
  const int64_t last = state_->number;
  for (int64_t number = 1; number <= last; ++number)
    ::unlink(numbered(state_->path, number).c_str());
  remove_dead_drafts(state_->path);
}

}  // namespace restage
