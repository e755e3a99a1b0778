// Files appear whole or not at all: written beside the target, fsynced, renamed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "autograd/base/error.h"
#include "autograd/base/temporary.h"

namespace restage {

/// A temporary path beside `target` that becomes `target` on commit() and is removed otherwise. If
/// `target` is a link, the file that it leads to is written and the link stays. Libraries that open
/// files by name (HDF5) write to path(). Errors (no such folder, a device or pipe: InputError; disk
/// full: WorkError) name the target.
class AtomicFile {
 public:
  explicit AtomicFile(std::string target);
  const std::string& path() const { return temporary_.path(); }
  void write(std::string_view content);  ///< writes all of `content` to path()
  void commit();                         ///< fsync file, rename, fsync folder

 private:
  std::string target_, place_;  ///< the target as it was given, and the same behind all links
  Temporary temporary_;
};

/// InputError or WorkError, by the system's error number, for a `place` that cannot be "written",
/// "used", or whatever `done` says.
[[noreturn]] void throw_refused(const std::string& place, const std::string& done, int code);
[[noreturn]] void throw_unwritable(const std::string& target, int code);
/// Makes a folder and those above it, if they are not there. Errors as throw_refused().
void make_folder(const std::string& path);
/// Writes all of `content` to an open file, with as many calls as it takes. Returns 0 or the
/// system's error number.
int write_all(int fd, std::string_view content);
/// Writes a whole file at once.
void write_file_atomically(const std::string& target, std::string_view content);
/// The bytes of a file could not be had: there is no such file, no permission, too many files are
/// open, the disk fails. That says nothing about what is in the file: who replaces damaged files
/// must pass this error on, and not take the file for damaged.
class ReadError : public InputError {
 public:
  /// `code`: the system's error number. The exit code is 2 where the user can mend it by another
  /// path or a permission, and 1 otherwise.
  ReadError(const std::string& path, int code);
  bool absent() const;  ///< there is no such file
 private:
  int code_;
};
/// Whether there is something at `path`. ReadError if that cannot be seen.
bool is_there(const std::string& path);
/// Reads a whole file. ReadError if the bytes cannot be had; InputError if it is no plain file (a
/// pipe could keep us waiting for ever) or has more than `limit` bytes.
std::string read_file(const std::string& path, uint64_t limit = uint64_t{1} << 32);
/// 64-bit FNV-1a based checksum of bytes, as 16 hex digits (detects damage, not malice).
std::string checksum(std::string_view bytes);

}  // namespace restage
