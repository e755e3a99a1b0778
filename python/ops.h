// The parts of restage.ops.
#pragma once

#include <array>
#include <string>

#include "autograd/kernels/matmul.h"
#include "python/bind.h"

namespace restage::python {

/// The names of Activation, in its order.
constexpr std::array<const char*, 2> activations() { return {"none", "relu"}; }
/// ShapeError for a name that is unknown.
Activation activation_of(const std::string& name);

/// ShapeError for a number of `op` below zero, or NaN.
void check_not_negative(const char* op, const char* name, double value);

void add_network_ops(py::module_& ops);  ///< norms, attention, recurrence, neighbours
void add_body_ops(py::module_& ops);     ///< rotations, skeletons, skinning

}  // namespace restage::python
