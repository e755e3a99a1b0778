#include "autograd/base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "autograd/base/error.h"

namespace restage {
namespace {

[[noreturn]] void fail(const std::string& target, int code) {
  const std::string why = std::strerror(code);
  if (code == ENOENT || code == ENOTDIR || code == EACCES || code == EISDIR || code == EROFS)
    throw InputError(target, "cannot be written (" + why + ")",
                     "give a path in a folder you can write to");
  throw WorkError(target + ": could not be written (" + why +
                  "); free some space and run it again");
}

void sync_path(const std::string& path, const std::string& target, int flags) {
  const int fd = ::open(path.c_str(), flags);
  if (fd < 0) fail(target, errno);
  const int result = ::fsync(fd);
  const int code = errno;
  ::close(fd);
  if (result != 0 && code != EINVAL) fail(target, code);
}

}  // namespace

AtomicFile::AtomicFile(std::string target) : target_(std::move(target)) {
  if (std::filesystem::is_directory(target_)) fail(target_, EISDIR);
  temporary_ = target_ + ".part" + std::to_string(::getpid());
  const int fd = ::open(temporary_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  if (fd < 0) fail(target_, errno);
  ::close(fd);
}

AtomicFile::~AtomicFile() {
  if (!done_) ::unlink(temporary_.c_str());
}

void AtomicFile::commit() {
  sync_path(temporary_, target_, O_RDONLY);
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(target_, errno);
  done_ = true;
  const auto folder = std::filesystem::path(target_).parent_path();
  sync_path(folder.empty() ? "." : folder.string(), target_, O_RDONLY | O_DIRECTORY);
}

void write_file_atomically(const std::string& target, std::string_view content) {
  AtomicFile file(target);
  std::FILE* out = std::fopen(file.path().c_str(), "wb");
  if (out == nullptr) fail(target, errno);
  const size_t written = std::fwrite(content.data(), 1, content.size(), out);
  const int code = errno;
  const bool closed = std::fclose(out) == 0;
  if (written != content.size()) fail(target, code);
  if (!closed) fail(target, errno);
  file.commit();
}

std::string read_file(const std::string& path, uint64_t limit) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    throw InputError(path, std::string("cannot be read (") + std::strerror(errno) + ")",
                     "check the path");
  if (S_ISDIR(info.st_mode)) throw InputError(path, "is a folder, not a file", "give a file");
  if (static_cast<uint64_t>(info.st_size) > limit)
    throw InputError(path, "is too large (" + std::to_string(info.st_size) + " bytes)",
                     "give a smaller file");
  std::FILE* in = std::fopen(path.c_str(), "rb");
  if (in == nullptr)
    throw InputError(path, std::string("cannot be read (") + std::strerror(errno) + ")",
                     "check the path");
  std::string content;
  char buffer[65536];
  size_t got = 0;
  while ((got = std::fread(buffer, 1, sizeof buffer, in)) > 0 && content.size() <= limit)
    content.append(buffer, got);
  std::fclose(in);
  return content;
}

std::string checksum(std::string_view bytes) {
  uint64_t h = 0xcbf29ce484222325ull;
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {  // eight bytes at a time, then one by one
    uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (h ^ word) * 0x100000001b3ull;
    h ^= h >> 29;
  }
  for (; i < bytes.size(); ++i) h = (h ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3ull;
  h ^= h >> 32;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(h));
  return text;
}

}  // namespace restage
