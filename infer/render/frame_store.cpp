#include "infer/render/frame_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "autograd/base/error.h"

namespace restage {
namespace {

[[noreturn]] void fail() {
  throw WorkError(std::string("a temporary file for long sequences failed (") +
                  std::strerror(errno) +
                  "); free some space, or give TMPDIR a folder that has some");
}

/// In the folder that TMPDIR names, which std::tmpfile() does not ask.
std::FILE* open_temporary() {
  std::error_code error;
  std::string path =
      (std::filesystem::temp_directory_path(error) / "restage-frames-XXXXXX").string();
  if (error) errno = error.value();
  const int file = error ? -1 : ::mkostemp(path.data(), O_CLOEXEC);
  if (file < 0) return nullptr;
  ::unlink(path.c_str());
  return ::fdopen(file, "w+b");
}

}  // namespace

TemporaryFile::TemporaryFile() : file_(open_temporary(), std::fclose) {
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
