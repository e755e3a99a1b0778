// How an op reaches a device. A kernel is a struct of arguments (its contract, in the headers
// beside this one); a backend is a table from contracts to functions, plus memory. Adding a device
// is adding a folder with a table; an op that calls a kernel the device lacks gets a named error.
// Kernels and copies of a device run in the order in which they are launched, perhaps later. What
// arguments point to on the host (spans, the structs themselves) is read before launch() returns.
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
  /// Kernels that were launched before may still use the memory.
  virtual void release(void* data, size_t bytes) = 0;
  virtual void fill_zero(void* data, size_t bytes) = 0;
  virtual void copy_in(void* to, const void* from_host, size_t bytes) = 0;
  virtual void copy(void* to, const void* from, size_t bytes) = 0;  ///< within its memory
  /// Returns when the numbers have arrived; throws what synchronise() throws.
  virtual void copy_out(void* to_host, const void* from, size_t bytes) = 0;
  /// Returns when everything that was launched is done. Error naming the kernel if one failed.
  virtual void synchronise() = 0;
  /// Whether launch() returns before the work is done, so that the host has time for other things.
  virtual bool works_later() const { return false; }
  virtual MemoryStats memory() const = 0;
  virtual void reset_peak() = 0;
  virtual void trim() = 0;  ///< gives free memory back to the system

  /// Runs a kernel; Error naming the kernel and the device if the device has no such kernel.
  virtual void run(std::type_index args_type, const void* args);

  /// add<MatmulArgs, cpu::matmul>() enters a function under its contract, before work begins. A
  /// program may enter kernels of its own: launch() finds them. Error if there is one already.
  template <class Args, void (*F)(const Args&)>
  void add() {
    enter(typeid(Args), [](const void* args) { F(*static_cast<const Args*>(args)); });
  }

 private:
  void enter(std::type_index args, Function function);
  std::unordered_map<std::type_index, Function> table_;
};

/// The backend of a device; Device{} is the CPU.
Backend& backend(Device device);
/// Enters a backend, which must outlive all its tensors. Error if there is a backend of that name
/// already.
Device add_device(Backend& backend);
/// The device of this name ("cpu"); InputError listing the devices that are built in.
Device device_of(std::string_view name);

/// Which GPU is "cuda" for the process number `local_rank` (from 0) of the processes that train
/// together on a host with `count` GPUs. Each process has a GPU of its own, unless there are more
/// processes than GPUs; then they share the GPUs evenly.
int gpu_of(int local_rank, int count);
/// Says which of them this process is (0 if nobody says it). To be called before the first
/// device_of("cuda").
void set_local_rank(int local_rank);
int local_rank();

/// Room for a result: a tensor of the dtype and on the device of another, not initialised.
inline Tensor empty_like(const Tensor& t, const Shape& shape) {
  return Tensor::empty(shape, t.dtype(), t.device());
}
inline Tensor empty_like(const Tensor& t) { return empty_like(t, t.shape()); }

/// Runs a kernel where its output lives, and counts the write (Tensor::version). A kernel that
/// changes memory which others may hold does so in `out`.
template <class Args>
void launch(const Args& args) {
  backend(args.out.device()).run(typeid(Args), &args);
  args.out.written();
}

}  // namespace restage
