// Shared by the files of this folder only: the lock, closing handles, and what a File holds.
#pragma once

#include <hdf5.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

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

/// An identifier of the library that is closed at the end of its scope (if it is one).
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

struct File::State {
  std::string path;
  hid_t id = -1;
  std::unique_ptr<AtomicFile> target;  ///< null when reading

  explicit State(std::string p) : path(std::move(p)) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State();
  /// "file:/name" for messages.
  std::string where(const std::string& name) const;
};

/// How every file is opened: closing it closes all that is in it. (A file that is open already can
/// only be opened again in the same way.)
Handle file_access();
/// A name from a file, made fit for a one-line message.
std::string printable(const std::string& name);
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
