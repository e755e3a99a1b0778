// Tensor: a contiguous, row-major, 64-byte aligned block of numbers with shared ownership. Copies
// are cheap handles. reshape() and rows() share memory; everything else makes a new tensor.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "autograd/tensor/shape.h"

namespace restage {

struct Storage;

template <class T>
struct DTypeOf;
template <>
struct DTypeOf<float> {
  static constexpr DType value = DType::f32;
};
template <>
struct DTypeOf<double> {
  static constexpr DType value = DType::f64;
};
template <>
struct DTypeOf<int32_t> {
  static constexpr DType value = DType::i32;
};
template <>
struct DTypeOf<int64_t> {
  static constexpr DType value = DType::i64;
};

class Tensor {
 public:
  Tensor() = default;
  static Tensor empty(const Shape& shape, DType type = DType::f32, Device device = {});
  static Tensor zeros(const Shape& shape, DType type = DType::f32, Device device = {});
  static Tensor full(const Shape& shape, double value, DType type = DType::f32, Device device = {});
  template <class T>
  static Tensor from(const Shape& shape, const std::vector<T>& values);
  /// Numbers in host memory of somebody else, which `owner` keeps there: no copy. `data` must be
  /// aligned for the dtype; it need not be 64-byte aligned, as after rows().
  static Tensor borrow(const Shape& shape, DType type, void* data, std::shared_ptr<void> owner);

  bool defined() const { return storage_ != nullptr; }
  const Shape& shape() const { return shape_; }
  int64_t size(int axis) const { return shape_[axis]; }
  int rank() const { return shape_.rank(); }
  int64_t numel() const { return numel_; }
  DType dtype() const { return dtype_; }
  Device device() const;

  /// Host pointer; T must match the dtype. Error naming the op that runs if the host may not read
  /// the memory of the device; cpu() brings the numbers to the host.
  template <class T>
  T* data();
  template <class T>
  const T* data() const;
  /// The host pointer, whatever the dtype.
  void* bytes();
  const void* bytes() const { return const_cast<Tensor*>(this)->bytes(); }
  /// The address on the tensor's device: for kernels of that device, and to tell tensors apart.
  const void* address() const { return base_; }

  /// How often the memory was written to, counted for all tensors that share it: what a tape keeps
  /// for the backward pass must not change until then. launch() counts writing the output of a
  /// kernel. Whoever writes through data() into memory that other tensors may share must call
  /// written().
  uint64_t version() const;
  void written();
  /// Whether somebody else holds the memory, too: another tensor, or whoever owns what was
  /// borrowed. Who writes to memory that is not shared changes nothing of others.
  bool shared() const;

  Tensor reshape(const Shape& shape) const;     ///< shares the memory; one dimension may be -1
  Tensor rows(int64_t from, int64_t to) const;  ///< a range of the leading axis, shares the memory
  Tensor clone() const;
  /// The same numbers on a device: the only way from one device to another. The same handle if the
  /// numbers are there already. A copy to the CPU waits for the numbers.
  Tensor to(Device device) const;
  Tensor cpu() const { return to(Device{}); }
  Tensor cast(DType type) const;         ///< the same handle if the type is equal
  double item(int64_t index = 0) const;  ///< one element as double; of host memory, as data()
  template <class T>
  std::vector<T> to_vector() const;  ///< of host memory, as data()

 private:
  size_t size_in_bytes() const { return static_cast<size_t>(numel_) * size_of(dtype_); }

  std::shared_ptr<Storage> storage_;
  void* base_ = nullptr;
  Shape shape_;
  int64_t numel_ = 0;
  DType dtype_ = DType::f32;
};

using NamedTensors = std::vector<std::pair<std::string, Tensor>>;
/// The tensors of a batch that are not undefined, with their names. (`each(f)` of a batch calls
/// f(name, tensor) for all of its tensors.)
template <class Batch>
NamedTensors named_tensors(Batch batch) {
  NamedTensors out;
  batch.each([&](const char* name, const Tensor& t) {
    if (t.defined()) out.emplace_back(name, t);
  });
  return out;
}
/// The same batch on a device.
template <class Batch>
Batch moved(Batch batch, Device device) {
  batch.each([&](const char*, Tensor& t) { t = t.to(device); });
  return batch;
}

/// Whether no element of x (f32 or f64) is NaN or infinite; waits for the device.
bool all_finite(const Tensor& x);

/// Memory of a device's tensors, bytes. A device keeps the blocks that tensors give back and hands
/// them out again.
struct MemoryStats {
  int64_t in_use = 0;             ///< by tensors
  int64_t peak = 0;               ///< the most that was in use since reset_peak_memory()
  int64_t kept = 0;               ///< free blocks that the device keeps
  int64_t large_allocations = 0;  ///< host: blocks of 1 MiB or more taken from the system so far
};
MemoryStats memory_stats(Device device = {});
void reset_peak_memory(Device device = {});
/// Gives the free blocks that a device keeps back to the system. A device does so by itself when it
/// is refused memory, before it says that there is no more. A GPU refuses. Linux refuses the host
/// only beyond a limit (ulimit -v, a strict vm.overcommit_memory): else it grants any size, and
/// ends a process that writes to more pages than there are.
void trim_memory(Device device = {});

}  // namespace restage
