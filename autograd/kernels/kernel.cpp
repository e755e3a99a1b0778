#include "autograd/kernels/kernel.h"

#include <atomic>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/module_path.h"
#include "autograd/base/words.h"

namespace restage {

Backend& cpu_backend();  // autograd/cpu/backend.cpp
bool add_cuda_device();  // autograd/cuda/backend.cu, with RESTAGE_CUDA: whether there is a GPU

namespace {

/// All backends; the kind of a device is its index. Devices are entered before the work begins.
std::vector<Backend*>& backends() {
  static std::vector<Backend*> all{&cpu_backend()};
  return all;
}

std::atomic<int> rank_on_host{0};

const char* cuda_missing() {
#ifdef RESTAGE_CUDA
  return "cuda finds no GPU on this machine";
#else
  return "cuda is not in this program, which was configured without -DRESTAGE_CUDA=ON";
#endif
}

}  // namespace

Backend& backend(Device device) {
  if (device.kind == 0) return cpu_backend();
  if (device.kind >= backends().size())
    throw Error("device " + std::to_string(device.kind) + " is not built in");
  return *backends()[device.kind];
}

void Backend::enter(std::type_index args, Function function) {
  if (!table_.emplace(args, function).second)
    throw Error(std::string("there is a kernel for ") + args.name() + " on " + std::string(name()) +
                " already");
}

Device add_device(Backend& backend) {
  for (const Backend* known : backends())
    if (known->name() == backend.name())
      throw Error("there is a device '" + std::string(backend.name()) + "' already");
  backends().push_back(&backend);
  return {static_cast<uint8_t>(backends().size() - 1), 0};
}

std::string name_of(Device device) { return std::string(backend(device).name()); }

Device device_of(std::string_view name) {
#ifdef RESTAGE_CUDA
  static const bool found [[maybe_unused]] = add_cuda_device();  // on the first call
#endif
  for (size_t i = 0; i < backends().size(); ++i)
    if (backends()[i]->name() == name) return {static_cast<uint8_t>(i), 0};
  const std::string known = joined(backends(), [](const auto& b) { return b->name(); });
  if (name == "cuda") throw InputError("device", cuda_missing(), "take one of: " + known);
  throw InputError("device", "'" + std::string(name) + "' is none that this program knows",
                   "take one of: " + known);
}

int gpu_of(int local_rank, int count) { return local_rank % count; }
void set_local_rank(int local_rank) { rank_on_host = local_rank; }
int local_rank() { return rank_on_host; }

MemoryStats memory_stats(Device device) { return backend(device).memory(); }
void reset_peak_memory(Device device) { backend(device).reset_peak(); }
void trim_memory(Device device) { backend(device).trim(); }

void Backend::run(std::type_index args_type, const void* args) {
  const auto it = table_.find(args_type);
  if (it == table_.end())
    throw Error(std::string("no kernel for ") + args_type.name() + " on " + std::string(name()) +
                " (" + running_op() + ")");
  it->second(args);
}

}  // namespace restage
