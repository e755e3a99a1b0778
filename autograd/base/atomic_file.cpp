#include "autograd/base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

void sync_path(const std::string& path, const std::string& target, int flags) {
  const int fd = ::open(path.c_str(), flags);
  if (fd < 0) throw_unwritable(target, errno);
  const int result = ::fsync(fd);
  const int code = errno;
  ::close(fd);
  if (result != 0 && code != EINVAL) throw_unwritable(target, code);
}

/// The place that is written for a target: behind all links, which stay. What is no plain file is
/// refused.
std::string place_of(const std::string& target) {
  fs::path place = target;
  std::error_code failed;
  for (int links = 0; fs::is_symlink(place, failed); ++links) {
    if (links == 40) throw_unwritable(target, ELOOP);
    const fs::path next = fs::read_symlink(place, failed);
    if (failed) throw_unwritable(target, failed.value());
    place = place.parent_path() / next;
  }
  struct stat info {};
  if (::stat(place.c_str(), &info) != 0) {
    if (errno == ENOENT) return place.string();
    throw_unwritable(target, errno);
  }
  if (S_ISDIR(info.st_mode)) throw_unwritable(target, EISDIR);
  if (!S_ISREG(info.st_mode))
    throw InputError(target, "is a device, pipe or socket", "give the name of a file");
  return place.string();
}

}  // namespace

void throw_refused(const std::string& place, const std::string& done, int code) {
  const std::string why = done + " (" + std::strerror(code) + ")";
  if (code == ENAMETOOLONG) throw InputError(place, "cannot be " + why, "shorten it");
  for (const int users : {ENOENT, ENOTDIR, EACCES, EPERM, EISDIR, EROFS, EEXIST, ELOOP})
    if (code == users)
      throw InputError(place, "cannot be " + why, "give a path in a folder you can write to");
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  throw WorkError(place + ": could not be " + why + "; " +
                  (full ? "free some space" : "look after the disk") + " and run it again");
}

void throw_unwritable(const std::string& target, int code) {
  throw_refused(target, "written", code);
}

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw_refused(path, "made", error.value());
}

int write_all(int fd, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written >= 0)
      content.remove_prefix(static_cast<size_t>(written));
    else if (errno != EINTR)
      return errno;
  }
  return 0;
}

AtomicFile::AtomicFile(std::string target)
    : target_(std::move(target)), place_(place_of(target_)), temporary_(name_beside(place_)) {
  const int fd = ::open(path().c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  if (fd < 0) throw_unwritable(target_, errno);
  ::close(fd);
}

void AtomicFile::write(std::string_view content) {
  const int fd = ::open(path().c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  if (fd < 0) throw_unwritable(target_, errno);
  int code = write_all(fd, content);
  if (::close(fd) != 0 && code == 0) code = errno;
  if (code != 0) throw_unwritable(target_, code);
}

void AtomicFile::commit() {
  sync_path(path(), target_, O_RDONLY);
  if (::rename(path().c_str(), place_.c_str()) != 0) throw_unwritable(target_, errno);
  temporary_.keep();
  const fs::path folder = fs::path(place_).parent_path();
  sync_path(folder.empty() ? "." : folder.string(), target_, O_RDONLY | O_DIRECTORY);
}

void write_file_atomically(const std::string& target, std::string_view content) {
  AtomicFile file(target);
  file.write(content);
  file.commit();
}

namespace {

/// By what the user can do about it.
std::string mend_of(int code) {
  if (code == ENOENT || code == ENOTDIR || code == ELOOP || code == ENAMETOOLONG)
    return "check the path";
  if (code == EACCES || code == EPERM) return "ask for the right to read it";
  if (code == EMFILE || code == ENFILE)
    return "close other programs or allow more open files (ulimit -n), and run it again";
  return "look after the disk and run it again";
}

}  // namespace

ReadError::ReadError(const std::string& path, int code)
    : InputError(path, std::string("cannot be read (") + std::strerror(code) + ")", mend_of(code)),
      code_(code) {
  for (const int users : {ENOENT, ENOTDIR, ELOOP, ENAMETOOLONG, EACCES, EPERM})
    if (code == users) return;
  exit_code = 1;
}

bool ReadError::absent() const { return code_ == ENOENT || code_ == ENOTDIR; }

bool is_there(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0) return true;
  const ReadError error(path, errno);
  if (error.absent()) return false;
  throw error;
}

std::string read_file(const std::string& path, uint64_t limit) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) throw ReadError(path, errno);
  if (S_ISDIR(info.st_mode)) throw InputError(path, "is a folder, not a file", "give a file");
  if (!S_ISREG(info.st_mode))
    throw InputError(path, "is a device, pipe or socket, not a file", "give a file");
  if (static_cast<uint64_t>(info.st_size) > limit)
    throw InputError(path, "is too large (" + std::to_string(info.st_size) + " bytes)",
                     "give a smaller file");
  std::FILE* in = std::fopen(path.c_str(), "rb");
  if (in == nullptr) throw ReadError(path, errno);
  std::string content;
  char buffer[65536];
  size_t got = 0;
  while ((got = std::fread(buffer, 1, sizeof buffer, in)) > 0 && content.size() <= limit)
    content.append(buffer, got);
  const int code = std::ferror(in) != 0 ? errno : 0;
  std::fclose(in);
  if (code != 0) throw ReadError(path, code);
  return content;
}

std::string checksum(std::string_view bytes) {
  uint64_t h = 0xcbf29ce484222325ull;
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {  // eight bytes at a time, then the last ones one by one
    uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (h ^ word) * 0x100000001b3ull;
    h ^= h >> 29;
  }
  for (; i < bytes.size(); ++i) h = (h ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3ull;
  h ^= h >> 32;
  return format("%016llx", static_cast<unsigned long long>(h));
}

}  // namespace restage
