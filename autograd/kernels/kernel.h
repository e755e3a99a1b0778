// How an op reaches a device. A kernel is a struct of arguments (its contract, in the headers
// beside this one); a backend is a table from contracts to functions, plus memory. Adding a device
// is adding a folder with a table; an op that calls a kernel the device lacks gets a named error.
#pragma once

#include <string_view>
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

  Function find(std::string_view kernel) const;  ///< Error naming kernel and backend if absent

 protected:
  /// add<MatmulArgs, cpu::matmul>() enters a function under its contract's name.
  template <class Args, void (*F)(const Args&)>
  void add() {
    table_[Args::name] = [](const void* args) { F(*static_cast<const Args*>(args)); };
  }

 private:
  std::unordered_map<std::string_view, Function> table_;
};

/// The backend of a device (autograd/kernels/kernel.cpp lists them).
Backend& backend(Device device);

/// Runs a kernel where its output lives, and counts the write (Tensor::version). A kernel that
/// changes memory which others may hold does so in `out`.
template <class Args>
void launch(const Args& args) {
  backend(args.out.device()).find(Args::name)(&args);
  args.out.written();
}

}  // namespace restage
