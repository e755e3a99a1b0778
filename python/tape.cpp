// restage.Tape, Var, Parameter, Gradients.
#include "autograd/tape/tape.h"

#include "python/arrays.h"
#include "python/context.h"
#include "python/copies.h"
#include "python/dlpack.h"
#include "python/var.h"

namespace restage::python {
namespace {

PyVar leaf_of(const std::shared_ptr<PyTape>& tape, const py::object& of) {
  uint64_t id = 0;
  Tensor value;
  PyParameter parameter;
  if (py::isinstance<Parameter>(of)) {
    parameter = of.cast<PyParameter>();
    id = parameter->id, value = parameter->value;
  } else {
    if (py::isinstance<PyVar>(of) && of.cast<const PyVar&>().var.on_tape())
      throw ShapeError("tape: a leaf of a value that is on a tape; give its detach()");
    id = Parameter::next_id(), value = tensor_of(of);
  }
  if (value.dtype() != DType::f32 && value.dtype() != DType::f64)
    throw ShapeError("tape: a leaf holds float32 or float64");
  const py::gil_scoped_release released;
  const std::lock_guard<std::recursive_mutex> lock(recording());
  tape->leaves.emplace(id, parameter);
  return {tape->tape.leaf(value, id), tape, id};
}

PyGradients backward_of(const PyVar& loss) {
  if (!loss.tape) throw ShapeError("backward: the loss is on no tape, so it depends on no leaf");
  const py::gil_scoped_release released;
  const std::lock_guard<std::recursive_mutex> lock(recording());
  auto leaves = std::exchange(loss.tape->leaves, {});
  return gradients_of(loss.tape->tape.backward(loss.var), std::move(leaves));
}

void add_parameter(py::module_& m) {
  py::class_<Parameter, PyParameter> parameter(
      m, "Parameter",
      "A trainable tensor; Tape.leaf() makes it a value. A copy of one is a Parameter of its own.");
  offer_memory(parameter, [](const Parameter& p) { return p.value; });
  parameter.attr("__array_ufunc__") = py::none();  // array * parameter would lose the gradient
  parameter
      .def(py::init([](const py::object& array, const std::optional<std::string>& dtype) {
             Tensor value = tensor_of(array).clone();
             if (dtype) value = value.cast(dtype_of(*dtype));
             if (value.dtype() != DType::f32 && value.dtype() != DType::f64)
               throw ShapeError("parameter: holds float32 or float64");
             return std::make_shared<Parameter>(value);
           }),
           py::arg("array"), py::arg("dtype") = py::none())
      .def_property_readonly(
          "value", [](const Parameter& p) { return p.value; }, "a Tensor, shared")
      .def_property_readonly("shape", [](const Parameter& p) { return tuple_of(p.value.shape()); })
      .def_property_readonly("size", [](const Parameter& p) { return p.value.numel(); })
      .def("numpy", [](const Parameter& p) { return array_of(p.value); })
      .def("__repr__",
           [](const Parameter& p) { return "Parameter(" + p.value.shape().str() + ")"; })
      .def(py::pickle([](const Parameter& p) { return py::make_tuple(p.value.clone()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Parameter>(state[0].cast<const Tensor&>().clone());
                      }));
}

void add_var(py::module_& m) {
  py::class_<PyVar> var(m, "Var",
                        R"(A value, and its place on a tape if it depends on a leaf.

Types as arrays do: + - * / ** @ abs() with NumPy's broadcasting, v[...], v.sum(axis), v.mean(), v.max(), v.reshape(),
v.T. A comparison such as v > 0 gives a constant of 1 and 0, so mask * a + (1 - mask) * b takes a where the mask holds.)");
  var.def_property_readonly(
         "value", [](const PyVar& v) { return v.var.value; }, "a Tensor, shared")
      .def_property_readonly("shape", [](const PyVar& v) { return tuple_of(v.var.shape()); })
      .def_property_readonly("dtype", [](const PyVar& v) { return name_of(v.var.dtype()); })
      .def_property_readonly("on_tape", [](const PyVar& v) { return v.var.on_tape(); })
      .def(
          "numpy", [](const PyVar& v) { return array_of(v.var.value); }, "A read-only view.")
      .def("item",
           [](const PyVar& v) {
             if (v.var.value.numel() != 1) throw ShapeError("item: the value is no single number");
             return v.var.value.cpu().item();
           })
      .def("detach",
           [](const PyVar& v) {
             return PyVar{v.var.detach(), nullptr, 0};
           })
      .def("backward", &backward_of,
           "Gradients of all leaves; the tape forgets what was recorded. Needs a single number.")
      .def(
          "keep_gradient",
          [](const PyVar& v) {
            if (!v.tape) throw ShapeError("keep_gradient: the value is on no tape");
            v.tape->tape.keep_gradient(v.var);
            return v;
          },
          "Has the next backward give this value's gradient, too (PyTorch's retain_grad); the "
          "value itself.")
      .def("__repr__", [](const PyVar& v) {
        return "Var(" + v.var.shape().str() + (v.var.on_tape() ? ", on a tape)" : ")");
      });
  offer_array(var, [](const PyVar& v) { return v.var.value; });
  add_arithmetic(var);
  add_indexing(var);
  add_reductions(var);
  refuse_copies(var,
                "a Var cannot be copied or pickled, as its tape would be lost: take its .value, "
                "which is a Tensor");
}

}  // namespace

bool& unrecorded() {
  thread_local bool off = false;
  return off;
}

PyVar var_of(const py::handle& value, const DType* like) {
  if (py::isinstance<PyVar>(value)) return as_seen(value.cast<const PyVar&>());
  if (py::isinstance<Parameter>(value))
    throw ShapeError(networks_running() > 0
                         ? "a parameter is no value yet; give ctx.leaf(parameter)"
                         : "a parameter is no value yet; give Tape.leaf(parameter) or its .value");
  Tensor t = tensor_of(value);
  // A plain number or list of Python is float64 to NumPy; beside a value it is of that one's type.
  const bool plain = !py::isinstance<Tensor>(value) &&
                     !PyObject_HasAttrString(value.ptr(), "dtype") &&
                     !PyObject_HasAttrString(value.ptr(), "__array__") && !lends_memory(value);
  if (like != nullptr && plain) t = t.cast(*like);
  return {Var(std::move(t)), nullptr, 0};
}

void add_tape(py::module_& m) {
  add_parameter(m);
  add_var(m);
  add_gradients(m);
  m.def("set_recording", [](bool on) { return !std::exchange(unrecorded(), !on); });
  py::class_<PyTape, std::shared_ptr<PyTape>> own(m, "Tape",
                                                  R"(Records ops, so that gradients can be computed.

x = tape.leaf(array_or_parameter) is a value to differentiate by; ops on it are recorded;
tape.backward(loss) gives the gradients of all leaves.)");
  refuse_copies(
      own,
      "a Tape cannot be copied or pickled, as it holds what ops recorded in this process: "
      "make a new one, and give it Tensors or Parameters, which can");
  own.def(py::init<>())
      .def("leaf", &leaf_of, py::arg("value"),
           "A Var to differentiate by; the same parameter always gives the same one.")
      .def(
          "backward",
          [](const std::shared_ptr<PyTape>& tape, const PyVar& loss) {
            if (loss.tape != tape) throw ShapeError("backward: the loss is not on this tape");
            return backward_of(loss);
          },
          py::arg("loss"), "Gradients of all leaves; what was recorded is forgotten.")
      .def("__bool__", [](const PyTape&) { return true; })  // as any object, also an empty one
      .def("__len__", [](const PyTape& t) { return t.tape.size(); });
}

}  // namespace restage::python
