// The parts of restage.Var: what NumPy's and PyTorch's users type, made of ops of the engine.
#pragma once

#include "python/engine.h"

namespace restage::python {

using VarClass = py::class_<PyVar>;

void add_arithmetic(VarClass& var);  ///< + - * / ** @ abs, comparisons (var_arithmetic.cpp)
void add_indexing(VarClass& var);    ///< v[...], len, iteration (var_indexing.cpp)
void add_reductions(VarClass& var);  ///< sum, mean, max, min, reshape, transpose (var_methods.cpp)
void add_gradients(py::module_& m);  ///< Gradients (gradients.cpp)

/// work(x) of a value: the one door of these parts to the ops, which records unless no_grad is on.
template <class Work>
PyVar on_value(const PyVar& v, const Work& work) {
  const PyVar seen = as_seen(v);
  return run_op(std::array{&seen}, [&] { return Var(work(seen.var)); });
}

}  // namespace restage::python
