// A network in Python.
#pragma once

#include <map>
#include <memory>

#include "nn/config/any_config.h"
#include "nn/weights/state.h"
#include "python/context.h"

namespace restage::python {

struct PyModel {
  using Bound = void;
  std::string name;
  std::shared_ptr<Module> net;
  AnyConfig sizes;
  /// In the order of the state dict; each keeps the network alive.
  std::vector<std::pair<std::string, PyParameter>> parameters() const;
};

using TensorMap = std::map<std::string, Tensor>;
TensorMap tensors_of(const py::dict& arrays);
/// Runs the network (model_call.cpp). ShapeError for inputs that do not fit it.
py::object call_model(const PyModel& model, const py::args& inputs,
                      const std::shared_ptr<PyTape>& tape, const std::shared_ptr<PyContext>& ctx,
                      bool training, uint64_t seed, uint64_t step);

}  // namespace restage::python
