#include "infer/render/frame_store.h"

#include <cerrno>
#include <cstring>
#include <string>

#include "autograd/base/error.h"

namespace restage {
namespace {

[[noreturn]] void fail() {
  throw WorkError(std::string("a temporary file for long sequences failed (") +
                  std::strerror(errno) + "); free some space and run it again");
}

}  // namespace

TemporaryFile::TemporaryFile() : file_(std::tmpfile(), std::fclose) {
  if (!file_) fail();
}

int64_t TemporaryFile::append(const void* bytes, size_t size) {
  const int64_t at = end_;
  if (::fseeko(file_.get(), at, SEEK_SET) != 0 || std::fwrite(bytes, 1, size, file_.get()) != size)
    fail();
  end_ += static_cast<int64_t>(size);
  return at;
}

void TemporaryFile::read(int64_t offset, void* bytes, size_t size) const {
  if (::fseeko(file_.get(), offset, SEEK_SET) != 0 ||
      std::fread(bytes, 1, size, file_.get()) != size)
    fail();
}

}  // namespace restage
