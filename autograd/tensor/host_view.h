// For devices whose kernels are host code: tests have one whose memory nobody else can read.
#pragma once

#include <cstddef>

#include "autograd/tensor/shape.h"

namespace restage {

/// While one lives, Tensor::data() gives the memory of `device`, `distance` bytes from where its
/// tensors say they are, and refuses that of any other: a kernel runs, on all threads.
class HostView {
 public:
  HostView(Device device, std::ptrdiff_t distance);
  ~HostView();
  HostView(const HostView&) = delete;
  HostView& operator=(const HostView&) = delete;
};

}  // namespace restage
