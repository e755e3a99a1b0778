// NPY arrays, versions 1.0 to 3.0: whole numbers, floating point (16, 32, 64 bits), truth values
// and fixed-size text, in both byte orders and both layouts (C, Fortran).
// Records of points (fields x, y, z and others of the same width) are arrays with one axis more.
// InputError for anything else: pickled objects (pickle.h reads these), other records, complex and
// extended numbers, a header that contradicts the number of bytes behind it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"
#include "datasets/readers/text/numbers.h"

namespace restage {

/// What stands before an array's elements.
struct NpyHeader {
  char kind = 'f';   ///< numpy's: b truth value, i integer, u unsigned, f floating, S bytes, U text
  size_t width = 8;  ///< bytes of one element
  const Number* type = nullptr;  ///< null for text
  bool big_endian = false, fortran = false;
  std::vector<int64_t> shape;  ///< slowest axis first; empty: one value
  int64_t count = 1;           ///< elements
  bool is_object = false;      ///< a pickle stands in place of the elements (pickle.h); no type
  bool is_text() const { return kind == 'S' || kind == 'U'; }
  uint64_t bytes() const { return static_cast<uint64_t>(count) * width; }
  /// The number stored in these `width` bytes; NaN for text.
  double number(const char* element) const {
    return type ? type->at(element, big_endian) : std::numeric_limits<double>::quiet_NaN();
  }
};

/// Reads the header; the stream then stands at the first element, and holds exactly the array's
/// bytes from there on. Of an array of objects, InputError unless `objects`, then at the pickle.
NpyHeader read_npy_header(ByteStream& in, bool objects = false);

/// Of elements that are called so by numpy ("<f4", "i8", "S5"), in this shape. InputError about
/// `where`: a type that is not read, an impossible shape.
NpyHeader npy_header_of(const std::string& type, const std::vector<int64_t>& shape,
                        const std::string& where);

/// A whole array in memory, as it lies in the file; elements are converted when asked for.
class NpyArray {
 public:
  /// InputError if the array takes more than `max_memory`.
  explicit NpyArray(ByteStream& in, uint64_t max_memory = kMaxMemory);
  /// Of bytes in memory, as many as the header says.
  NpyArray(NpyHeader header, std::vector<char> bytes, std::string where);

  const NpyHeader& header() const { return header_; }
  const std::vector<char>& bytes() const { return bytes_; }  ///< as they lie in the file
  std::vector<char> in_order() const;                        ///< the same in C order
  /// Part `i` of the first axis, without this axis, in C order.
  NpyArray part(int64_t i) const;

  const std::vector<int64_t>& shape() const { return header_.shape; }
  int64_t size() const { return header_.count; }
  bool is_text() const { return header_.is_text(); }
  /// Whether it holds numbers, in this shape; -1: any length.
  bool is_shaped(const std::vector<int64_t>& wanted) const;
  const std::string& where() const { return where_; }

  /// Element i in C order, whatever the file's order is; NaN for text.
  double operator[](int64_t i) const;
  /// All numbers in C order. InputError if one is NaN or infinite.
  std::vector<double> finite() const;
  /// Element i as UTF-8, without trailing zeros; empty if there is no such element or no text.
  std::string text(int64_t i = 0) const;

 private:
  size_t place(int64_t i) const;  ///< of element i of C order, in bytes_
  NpyHeader header_;
  std::vector<char> bytes_;
  std::string where_;
};

NpyArray read_npy(const std::string& path, uint64_t max_memory = kMaxMemory);

/// "[10, 22, 3]"
std::string shape_text(const std::vector<int64_t>& shape);

}  // namespace restage
