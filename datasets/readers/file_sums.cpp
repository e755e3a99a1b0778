#include "datasets/readers/file_sums.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "datasets/readers/sha256.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kWorthKeeping = int64_t{8} << 20;  // bytes; smaller files are read in no time
constexpr size_t kMostKept = 256;
constexpr uint64_t kMostBytes = uint64_t{4} << 20;  // of the cache
constexpr int64_t kSecond = 1'000'000'000;          // in nanoseconds
constexpr int64_t kTooRecent = 2 * kSecond;

int64_t nanoseconds(const timespec& t) { return int64_t{t.tv_sec} * kSecond + t.tv_nsec; }

/// What changes when a file does.
struct Stamp {
  int64_t device, inode, size, written, changed;

  explicit Stamp(const std::string& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) throw ReadError(path, errno);
    device = static_cast<int64_t>(info.st_dev);
    inode = static_cast<int64_t>(info.st_ino);
    size = info.st_size;
    written = nanoseconds(info.st_mtim);
    changed = nanoseconds(info.st_ctim);
  }
  bool operator==(const Stamp&) const = default;
  std::string text() const {
    std::string out;
    for (const int64_t number : {device, inode, size, written, changed})
      out += (out.empty() ? "" : ":") + std::to_string(number);
    return out;
  }
  /// Whether a change after `moment` must have another time than this.
  bool surely_before(int64_t moment) const {
    return std::max(written, changed) + kTooRecent < moment;
  }
};

/// "" without a home.
std::string cache_file() {
  const std::string folder = user_cache();
  return folder.empty() ? "" : folder + "/sums";
}

/// A line of the cache: "CHECKSUM SHA256 STAMP PATH", the first of all that follows it.
struct Entry {
  std::string sum, stamp, path;

  std::string line() const {
    const std::string text = sum + " " + stamp + " " + path;
    return checksum(text) + " " + text;
  }
};

std::optional<Entry> parsed(const std::string& line) {
  constexpr size_t kDigits = 16;  // of checksum()
  if (line.size() <= kDigits || line[kDigits] != ' ') return std::nullopt;
  const std::string text = line.substr(kDigits + 1);
  if (checksum(text) != line.substr(0, kDigits)) return std::nullopt;
  const size_t first = text.find(' '), second = text.find(' ', first + 1);
  if (second == std::string::npos) return std::nullopt;
  Entry out{text.substr(0, first), text.substr(first + 1, second - first - 1),
            text.substr(second + 1)};
  return is_sha256(out.sum) ? std::optional(out) : std::nullopt;
}

std::vector<Entry> kept(const std::string& cache) {
  std::vector<Entry> out;
  try {
    if (!is_there(cache)) return out;
    std::istringstream lines(read_file(cache, kMostBytes));
    for (std::string line; std::getline(lines, line);)
      if (auto entry = parsed(line)) out.push_back(std::move(*entry));
  } catch (const Error& error) {
    log_debug("checksums of files are not taken from the cache: " + std::string(error.what()));
  }
  return out;
}

/// Of two processes that keep something at once the later one wins; the other computes anew.
void keep(const std::string& cache, Entry fresh) {
  try {
    std::vector<Entry> all = kept(cache);
    std::erase_if(all, [&](const Entry& entry) { return entry.path == fresh.path; });
    all.push_back(std::move(fresh));
    std::string text;
    for (size_t i = all.size() - std::min(all.size(), kMostKept); i < all.size(); ++i)
      text += all[i].line() + "\n";
    fs::create_directories(fs::path(cache).parent_path());
    write_file_atomically(cache, text);
  } catch (const std::exception& error) {
    log_debug("the checksum of a file is not kept: " + std::string(error.what()));
  }
}

}  // namespace

std::string user_cache() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache != nullptr && cache[0] == '/') return std::string(cache) + "/restage";
  if (home != nullptr && home[0] == '/') return std::string(home) + "/.cache/restage";
  return "";
}

std::string kept_sha256(const std::string& path) {
  return kept_sum(path, "", [&] { return sha256_of_file(path); });
}

std::string kept_sum(const std::string& path, const std::string& kind,
                     const std::function<std::string()>& compute) {
  const Stamp before(path);
  const std::string cache = cache_file(),
                    place = kind + fs::absolute(path).lexically_normal().string();
  if (before.size < kWorthKeeping || cache.empty() || place.find('\n') != std::string::npos)
    return compute();
  for (const Entry& entry : kept(cache))
    if (entry.path == place && entry.stamp == before.text()) return entry.sum;
  using Clock = std::chrono::system_clock;
  const auto now =
      std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch());
  const std::string sum = compute();
  if (before.surely_before(now.count()) && Stamp(path) == before)
    keep(cache, {sum, before.text(), place});
  return sum;
}

}  // namespace restage
