#include "autograd/kernels/kernel.h"

#include <string>

#include "autograd/base/error.h"

namespace restage {

Backend& cpu_backend();  // autograd/cpu/backend.cpp

Backend& backend(Device device) {
  if (device.kind != 0)
    throw Error("device " + std::to_string(device.kind) + " is not built in; only 0 (cpu) is");
  return cpu_backend();
}

Backend::Function Backend::find(std::type_index args) const {
  const auto it = table_.find(args);
  if (it == table_.end())
    throw Error(std::string("no kernel for ") + args.name() + " on " + std::string(name()));
  return it->second;
}

}  // namespace restage
