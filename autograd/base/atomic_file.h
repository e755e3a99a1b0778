// Files appear whole or not at all: written beside the target, fsynced, renamed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace restage {

/// A temporary path beside `target` that becomes `target` on commit() and is removed otherwise.
/// Libraries that open files by name (HDF5) write to path(). Errors (no such folder: InputError;
/// disk full: WorkError) name the target.
class AtomicFile {
 public:
  explicit AtomicFile(std::string target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  const std::string& path() const { return temporary_; }
  void commit();  ///< fsync file, rename, fsync folder

 private:
  std::string target_, temporary_;
  bool done_ = false;
};

/// The whole content at once.
void write_file_atomically(const std::string& target, std::string_view content);
/// Reads a whole file; InputError if it cannot be read or has more than `limit` bytes.
std::string read_file(const std::string& path, uint64_t limit = uint64_t{1} << 32);
/// 64-bit FNV-1a based checksum of bytes, as 16 hex digits (detects damage, not malice).
std::string checksum(std::string_view bytes);

}  // namespace restage
