// Shared by the files of this folder only: the lock, closing handles, and what a File holds.
#pragma once

#include <hdf5.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "autograd/base/atomic_file.h"
#include "datasets/hdf5/file.h"

namespace restage::h5 {

/// Holds the one lock over the library and silences its error printing on this thread.
class Lock {
 public:
  Lock();

 private:
  std::unique_lock<std::recursive_mutex> lock_;
};

/// How handles are closed that live longer than a Lock.
template <herr_t (*close)(hid_t)>
herr_t locked(hid_t id) {
  const Lock lock;
  return close(id);
}

struct File::State {
  std::string path;
  std::unique_ptr<AtomicFile> target = nullptr;  ///< null when reading
  Handle id{-1, locked<H5Fclose>};

  /// "file:/name" for messages.
  std::string where(const std::string& name) const;
};

/// How every file is opened: closing it closes all that is in it. (A file that is open already can
/// only be opened again in the same way.)
Handle file_access();
/// Strings of this many bytes (H5T_VARIABLE: any number), in memory or, padded with zeros, in a
/// file.
Handle text_type(size_t width, H5T_cset_t letters);
/// A name from a file, made fit for a one-line message.
std::string printable(const std::string& name);
[[noreturn]] void throw_damaged(const std::string& where);
/// WorkError with the system's reason (disk full) from the library's error stack.
[[noreturn]] void throw_write_error(const std::string& path);
/// What a file's type holds. InputError but for plain machine types and text: odd bit layouts exist
/// in no honest file, and converting them is where the library has been attacked.
Type classify(hid_t type, const std::string& where);
/// Whether not every value fits an int32_t.
bool is_wide_integer(hid_t type);
/// How a group's members are listed: as they were made, if the file knows, else by name.
H5_index_t order_of(hid_t group);
/// Whether every part of the path is there. InputError for links into other files.
bool link_exists(const File::State& state, const std::string& name);

}  // namespace restage::h5
