// The engine in Python: tensors, values on a tape, parameters.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <map>
#include <memory>
#include <mutex>

#include "autograd/tape/tape.h"
#include "nn/module.h"
#include "python/bind.h"

namespace restage::python {

/// What is recorded on tapes is recorded by one thread at a time. To be taken without the GIL, as
/// an op of Python takes the GIL while it holds this.
std::recursive_mutex& recording();

/// Whether ops of this thread are computed and not recorded (restage.no_grad).
bool& unrecorded();

/// A parameter, with the module that it belongs to.
using PyParameter = std::shared_ptr<Parameter>;

/// A tape that lives as long as a value on it does, so that no value of Python's can lose its tape.
struct PyTape {
  using Bound = void;
  Tape tape;
  /// Its leaves since the last backward, by identity; null: no parameter.
  std::map<uint64_t, PyParameter> leaves = {};
};

struct PyVar {
  using Bound = void;
  Var var;
  std::shared_ptr<PyTape> tape;  ///< null: a constant, or a value on a tape of C++ (gradcheck)
  uint64_t leaf = 0;             ///< its identity, if it is a leaf
};

/// The value as an op sees it: a constant while nothing is recorded.
inline PyVar as_seen(const PyVar& v) {
  return unrecorded() ? PyVar{v.var.detach(), nullptr, 0} : v;
}

struct PyGradients {
  using Bound = void;
  Gradients gradients;
  std::map<uint64_t, PyParameter> leaves = {};  ///< those that took part; null: no parameter
  /// Of a leaf or a parameter; null if the loss does not depend on it.
  const Tensor* find(const py::handle& of) const;
};

/// With those of the leaves that took part.
PyGradients gradients_of(Gradients gradients, std::map<uint64_t, PyParameter> leaves);

DType dtype_of(const std::string& name);
Shape shape_of(const py::handle& value);
py::tuple tuple_of(const Shape& shape);

/// The array's numbers: float32, float64, int32 and int64 as they are, other integers and float16
/// in the nearest of them. `share`: no copy where the memory is fit for it. ShapeError for others.
Tensor tensor_of(const py::handle& value, bool share = false);
/// An array over the tensor's memory, which it keeps alive; read-only, as tapes rely on it.
py::array array_of(const Tensor& tensor);
/// A Var, a Tensor, an array, or a number in the dtype of `like`, as a value for an op.
PyVar var_of(const py::handle& value, const DType* like = nullptr);
/// int32, a copy of its own, so that nobody can change what was checked.
Tensor index_of(const py::handle& value);

/// Runs an op on values, without the GIL; the result is on the tape of the inputs.
template <class Inputs, class Work>
PyVar run_op(const Inputs& inputs, const Work& work) {
  PyVar out;
  for (const PyVar* v : inputs)
    if (v->tape) out.tape = v->tape;
  const py::gil_scoped_release released;
  std::unique_lock<std::recursive_mutex> lock(recording(), std::defer_lock);
  bool on_tape = false;
  // A tape of C++ is recorded by the thread that made it, and needs no lock.
  for (const PyVar* v : inputs) on_tape = on_tape || (v->tape && v->var.on_tape());
  if (on_tape) lock.lock();
  out.var = work();
  if (!out.var.on_tape()) out.tape = nullptr;
  return out;
}

/// What Python gave as values; numbers and lists are of the type of the first Var among them.
template <size_t N>
std::array<PyVar, N> vars_of(const std::array<py::object, N>& given) {
  std::optional<DType> like;
  for (const py::object& one : given)
    if (!like && py::isinstance<PyVar>(one)) like = one.cast<const PyVar&>().var.dtype();
  std::array<PyVar, N> out;
  for (size_t i = 0; i < N; ++i) out[i] = var_of(given[i], like ? &*like : nullptr);
  return out;
}
template <size_t N>
std::array<const PyVar*, N> pointers(const std::array<PyVar, N>& vars) {
  std::array<const PyVar*, N> out{};
  for (size_t i = 0; i < N; ++i) out[i] = &vars[i];
  return out;
}
/// work(a, b, ...) of the values that Python gave.
template <class Work, class... Objects>
PyVar op_of(const Work& work, const Objects&... given) {
  const auto vars = vars_of(std::array<py::object, sizeof...(given)>{given...});
  return run_op(pointers(vars), [&] {
    return [&]<size_t... I>(std::index_sequence<I...>) { return Var(work(vars[I].var...)); }
    (std::index_sequence_for<Objects...>{});
  });
}

}  // namespace restage::python
