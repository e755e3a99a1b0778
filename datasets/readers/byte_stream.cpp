#include "datasets/readers/byte_stream.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr uint64_t kPiece = uint64_t{1} << 20;

[[noreturn]] void throw_unreadable(const std::string& path) {
  throw InputError(path, cat("cannot be read (", std::strerror(errno), ")"), "check the path");
}

}  // namespace

void ByteStream::read(char* out, size_t n) {
  if (n > left())
    throw InputError(where_, cat("ends after ", size_, " bytes, in the middle of it"),
                     "it is cut short: copy or export it again");
  if (n > 0) do_read(out, n);
  position_ += n;
}

std::vector<char> ByteStream::take(uint64_t n) {
  std::vector<char> out;
  for (uint64_t done = 0; done < n;) {
    const uint64_t piece = std::min(n - done, std::max(kPiece, done));
    out.resize(done + piece);
    read(out.data() + done, static_cast<size_t>(piece));
    done += piece;
  }
  return out;
}

void ByteStream::skip(uint64_t n) {
  if (n > left()) read(nullptr, static_cast<size_t>(n));  // throws
  do_skip(n);
  position_ += n;
}

void ByteStream::do_skip(uint64_t n) {
  std::vector<char> dropped(static_cast<size_t>(std::min(n, kPiece)));
  for (uint64_t done = 0; done < n;) {
    const uint64_t piece = std::min(n - done, kPiece);
    do_read(dropped.data(), static_cast<size_t>(piece));
    done += piece;
  }
}

void ByteStream::rewind() {
  do_rewind();
  position_ = 0;
}

FileStream::FileStream(const std::string& path)
    : ByteStream(path, file_size_of(path)), file_(path, std::ios::binary) {
  if (!file_) throw_unreadable(path);
}

void FileStream::do_read(char* out, size_t n) {
  if (!file_.read(out, static_cast<std::streamsize>(n)))
    throw InputError(where(), "ends before its last byte",
                     "it was cut while being read: try again");
}

void FileStream::do_skip(uint64_t n) { file_.seekg(static_cast<std::streamoff>(n), std::ios::cur); }

void FileStream::do_rewind() {
  file_.clear();
  file_.seekg(0);
}

uint64_t file_size_of(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) throw_unreadable(path);
  if (!S_ISREG(info.st_mode)) throw InputError(path, "is no file", "give a file");
  return static_cast<uint64_t>(info.st_size);
}

}  // namespace restage
