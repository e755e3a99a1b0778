// For devices whose kernels are host code. Tests have such a device, whose memory nobody but its
// kernels can read.
#pragma once

#include <cstddef>

#include "autograd/tensor/shape.h"

namespace restage {

/// While a HostView lives, on all threads, Tensor::data() gives the memory of `device`, `distance`
/// bytes from the addresses of its tensors, and refuses the memory of any other device. It lives
/// while a kernel runs.
class HostView {
 public:
  HostView(Device device, std::ptrdiff_t distance);
  ~HostView();
  HostView(const HostView&) = delete;
  HostView& operator=(const HostView&) = delete;
};

}  // namespace restage
