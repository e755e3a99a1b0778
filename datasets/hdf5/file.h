// HDF5 files as C++ values: the only place (with file.cpp) that knows the HDF5 library.
// Every failure to read is an InputError that names file and data set ("x.h5:/joints: is missing;
// ..."), every failure to write a WorkError; the library prints nothing. Sizes written in a file
// are never trusted: they are compared with what the file stores, and with set_max_memory(), before
// memory is taken. One lock guards all calls, so files may be used from several threads (each File
// from one at a time).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace restage::h5 {

using Shape = std::vector<int64_t>;  ///< lengths of the axes, slowest first; empty: one value

/// Most that the values of one read, or one chunk of a file, may take in memory, in bytes; at first
/// 16 GiB. Holds for all files of this process: `--max-memory`.
void set_max_memory(uint64_t bytes);

/// "[10, 22, 3]"; -1 (any length) is written as *.
std::string to_string(const Shape& shape);

/// An identifier of the library that is closed at the end of its scope (if it is one).
class Handle {
 public:
  Handle(int64_t id, int (*close)(int64_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(other.release()), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator int64_t() const { return id_; }
  int64_t release() { return std::exchange(id_, -1); }  ///< not to be closed here any more

 private:
  int64_t id_;
  int (*close_)(int64_t);
};

enum class Type { floating, integer, text };

/// One open data set. T below is double, float, int64_t, int32_t, int16_t or uint8_t; values are
/// converted, except that a fraction never becomes an integer and an integer that does not fit is
/// an InputError.
class Dataset {
 public:
  const Shape& shape() const { return shape_; }
  Type type() const { return type_; }
  size_t value_size() const;  ///< bytes of one value in the file
  int64_t rows() const { return shape_.empty() ? 1 : shape_[0]; }
  int64_t row_size() const;                            ///< values in one step of axis 0
  const std::string& where() const { return where_; }  ///< "file:/name", for messages

  template <class T>
  std::vector<T> read() const;
  /// Rows [first, first + count) of axis 0 into `out`, which is resized. For streaming.
  template <class T>
  void read_rows(int64_t first, int64_t count, std::vector<T>& out) const;
  std::vector<std::string> read_text() const;

  /// Adds rows at the end of axis 0; the length must be a multiple of row_size(). Only for data
  /// sets made by File::create_appendable().
  template <class T>
  void append(std::span<const T> values);
  void truncate(int64_t rows);  ///< keeps the first `rows` of what was appended

 private:
  friend class File;
  Dataset() = default;
  void check_memory(int64_t values, size_t value_size) const;
  void read_raw(int64_t first, int64_t count, int64_t memory_type, void* out) const;

  Handle id_{-1, nullptr};
  Shape shape_;
  Type type_ = Type::floating;
  std::string where_, path_;
  bool wide_ = false;  ///< integers that may not fit int32: 64 bits, or unsigned 32
};

/// An open file. Moved, never copied.
class File {
 public:
  /// For reading. InputError: missing, not HDF5, cut short.
  static File open(const std::string& path);
  /// For writing; nothing appears under `path` before commit() (AtomicFile).
  static File create(const std::string& path);
  File(File&&) noexcept;
  File& operator=(File&&) noexcept;
  ~File();

  /// Closes, syncs and renames. Appendable data sets of this file must not be used afterwards.
  void commit();
  const std::string& path() const;

  bool has(const std::string& name) const;  ///< a data set or group, "/a/b"
  bool is_group(const std::string& name) const;
  /// Names of the members of a group: in the order they were made if the file keeps it (ours do),
  /// else by name.
  std::vector<std::string> children(const std::string& group = "/") const;

  /// InputError if missing, not numbers or text, compressed by a filter other than gzip, shuffle
  /// and fletcher32, or not of the wanted shape (-1: any length).
  Dataset dataset(const std::string& name) const;
  Dataset dataset(const std::string& name, const Shape& wanted) const;
  template <class T>
  std::vector<T> read(const std::string& name, const Shape& wanted) const {
    return dataset(name, wanted).template read<T>();
  }

  /// A new data set, chunked, shuffled, gzipped and checksummed; groups are made as needed.
  template <class T>
  void write(const std::string& name, const Shape& shape, std::span<const T> values);
  template <class T>
  void write(const std::string& name, const Shape& shape, const std::vector<T>& values) {
    write(name, shape, std::span<const T>(values));
  }
  /// A new data set of strings [N], UTF-8.
  void write_text(const std::string& name, const std::vector<std::string>& values);
  /// A new data set with no rows yet, each of the shape `row` (empty: one value).
  template <class T>
  Dataset create_appendable(const std::string& name, const Shape& row);
  void create_group(const std::string& name);

  /// Attributes of the file ("/"), a group or a data set. Readers give nothing if the attribute is
  /// missing and throw InputError if it is of another kind.
  void set_text(const std::string& object, const std::string& name, const std::string& value);
  void set_number(const std::string& object, const std::string& name, double value);
  void set_integer(const std::string& object, const std::string& name, int64_t value);
  std::optional<std::string> text(const std::string& object, const std::string& name) const;
  std::optional<double> number(const std::string& object, const std::string& name) const;
  std::optional<int64_t> integer(const std::string& object, const std::string& name) const;
  /// Takes over the attributes of an object of another file that the object has not got here:
  /// numbers and text. The names of those that could not be taken.
  std::vector<std::string> copy_attributes(const File& from, const std::string& object);

 public:
  struct State;  ///< for the files of this folder

 private:
  explicit File(std::unique_ptr<State> state);
  Handle make_dataset(const std::string& name, const Shape& shape, int64_t type, bool grows);
  std::unique_ptr<State> state_;
};

}  // namespace restage::h5
