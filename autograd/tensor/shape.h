// Dtypes, devices and shapes.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>

namespace restage {

enum class DType : uint8_t { f32, f64, i32, i64 };
size_t size_of(DType type);
const char* name_of(DType type);

/// Where a tensor lives. `kind` 0 is the CPU; the kinds of other devices are given by add_device().
struct Device {
  uint8_t kind = 0;
  uint8_t index = 0;
  bool operator==(const Device&) const = default;
};
std::string name_of(Device device);  ///< "cpu"

/// Up to six dimensions, row-major, no heap.
class Shape {
 public:
  static constexpr int kMaxRank = 6;
  Shape() = default;
  Shape(std::initializer_list<int64_t> dims);
  int rank() const { return rank_; }
  /// Negative axes count from the end.
  int64_t operator[](int axis) const {
    return dims_[static_cast<size_t>(axis < 0 ? axis + rank_ : axis)];
  }
  void set(int axis, int64_t size) {
    dims_[static_cast<size_t>(axis < 0 ? axis + rank_ : axis)] = size;
  }
  void push_back(int64_t size);
  int64_t numel() const;
  /// Product of dimensions [from, to).
  int64_t product(int from, int to) const;
  std::string str() const;  ///< "[2, 3]"
  bool operator==(const Shape& other) const;

 private:
  std::array<int64_t, kMaxRank> dims_{};
  int rank_ = 0;
};

/// The shape to which a and b are broadcast, as numpy does it; `ok` is false if they do not fit.
Shape broadcast_shape(const Shape& a, const Shape& b, bool* ok);

}  // namespace restage
