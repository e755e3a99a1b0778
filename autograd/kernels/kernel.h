// How an op reaches a device. A kernel is a struct of arguments (its contract, in the headers
// beside this one); a backend is a table from contracts to functions, plus memory. Adding a device
// is adding a folder with a table; an op that calls a kernel the device lacks gets a named error.
#pragma once

#include <string_view>
#include <typeindex>
#include <unordered_map>

#include "autograd/tensor/tensor.h"

namespace restage {

class Backend {
 public:
  using Function = void (*)(const void* args);
  virtual ~Backend() = default;
  virtual std::string_view name() const = 0;
  virtual void* allocate(size_t bytes) = 0;
  virtual void release(void* data, size_t bytes) = 0;
  virtual void fill_zero(void* data, size_t bytes) = 0;

  Function find(std::type_index args) const;  ///< Error naming both if there is none for such

 protected:
  /// add<MatmulArgs, cpu::matmul>() enters a function under its contract.
  template <class Args, void (*F)(const Args&)>
  void add() {
    table_[typeid(Args)] = [](const void* args) { F(*static_cast<const Args*>(args)); };
  }

 private:
  std::unordered_map<std::type_index, Function> table_;
};

/// The backend of a device (autograd/kernels/kernel.cpp lists them).
Backend& backend(Device device);

/// Room for a result: a tensor of the dtype and on the device of another, not initialised.
inline Tensor empty_like(const Tensor& t, const Shape& shape) {
  return Tensor::empty(shape, t.dtype(), t.device());
}
inline Tensor empty_like(const Tensor& t) { return empty_like(t, t.shape()); }

/// Runs a kernel where its output lives, and counts the write (Tensor::version). A kernel that
/// changes memory which others may hold does so in `out`.
template <class Args>
void launch(const Args& args) {
  backend(args.out.device()).find(typeid(Args))(&args);
  args.out.written();
}

}  // namespace restage
