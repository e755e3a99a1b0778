#include "autograd/base/temporary.h"

#include <dirent.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <climits>
#include <cstring>
#include <filesystem>

#include "autograd/base/host.h"

namespace restage {
namespace {

/// A path that a signal handler can read. It is no string, whose memory might just be moved.
struct Slot {
  std::atomic<bool> taken{false}, live{false};
  char path[PATH_MAX];
};
std::array<Slot, 64> slots;
static_assert(std::atomic<bool>::is_always_lock_free, "used in a signal handler");

int take_slot(const std::string& path) {
  if (path.size() >= PATH_MAX) return -1;  // no file can be made under it
  for (size_t i = 0; i < slots.size(); ++i) {
    if (slots[i].taken.exchange(true)) continue;
    std::memcpy(slots[i].path, path.c_str(), path.size() + 1);
    slots[i].live = true;
    return static_cast<int>(i);
  }
  return -1;
}

void free_slot(int slot) {
  if (slot < 0) return;
  slots[slot].live = false;
  slots[slot].taken = false;
}

/// std::filesystem takes memory, which a signal handler may not.
void remove_at(int parent, const char* path, int depth) noexcept {
  if (::unlinkat(parent, path, 0) == 0 || depth == 0) return;
  const int folder =
      ::openat(parent, path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (folder < 0) return;
  alignas(dirent64) char entries[4096];
  for (ssize_t n; (n = ::getdents64(folder, entries, sizeof entries)) > 0;)
    for (ssize_t at = 0; at < n;) {
      const auto* entry = reinterpret_cast<const dirent64*>(entries + at);
      at += entry->d_reclen;
      if (std::strcmp(entry->d_name, ".") != 0 && std::strcmp(entry->d_name, "..") != 0)
        remove_at(folder, entry->d_name, depth - 1);
    }
  ::close(folder);
  ::unlinkat(parent, path, AT_REMOVEDIR);
}

}  // namespace

std::string name_beside(const std::string& target, const std::string& prefix) {
  const std::filesystem::path path(target);
  const std::string end = ".part" + unique_token();
  const size_t room = NAME_MAX - prefix.size() - end.size();
  return (path.parent_path() / (prefix + path.filename().string().substr(0, room) + end)).string();
}

Temporary::Temporary(std::string path) : path_(std::move(path)), slot_(take_slot(path_)) {}

Temporary::~Temporary() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  free_slot(slot_);
}

void Temporary::keep() {
  path_.clear();
  free_slot(slot_);
  slot_ = -1;
}

void remove_temporaries() noexcept {
  for (const Slot& slot : slots)
    if (slot.live) remove_at(AT_FDCWD, slot.path, 8);
}

}  // namespace restage
