// restage.Tape, Var, Parameter, Gradients.
#include "autograd/tape/tape.h"

#include "autograd/ops/elementwise.h"
#include "python/engine.h"

namespace restage::python {
namespace {

PyVar leaf_of(const std::shared_ptr<PyTape>& tape, const py::object& of) {
  uint64_t id = 0;
  Tensor value;
  if (py::isinstance<Parameter>(of)) {
    const auto p = of.cast<PyParameter>();
    id = p->id, value = p->value;
  } else {
    if (py::isinstance<PyVar>(of) && of.cast<const PyVar&>().var.on_tape())
      throw ShapeError("tape: a leaf of a value that is on a tape; give its detach()");
    id = Parameter::next_id(), value = tensor_of(of);
  }
  if (value.dtype() != DType::f32 && value.dtype() != DType::f64)
    throw ShapeError("tape: a leaf holds float32 or float64");
  const py::gil_scoped_release released;
  const std::lock_guard<std::recursive_mutex> lock(recording());
  return {tape->tape.leaf(value, id), tape, id};
}

PyGradients backward_of(const PyVar& loss) {
  if (!loss.tape) throw ShapeError("backward: the loss is on no tape, so it depends on no leaf");
  const py::gil_scoped_release released;
  const std::lock_guard<std::recursive_mutex> lock(recording());
  return {loss.tape->tape.backward(loss.var)};
}

enum class With { add, sub, mul, div };

/// A number beside a value: the ops that take one.
PyVar with_number(With how, const PyVar& a, double c, bool reversed) {
  return run_op(std::array{&a}, [&]() -> Var {
    const Var& x = a.var;
    switch (how) {
      case With::add:
        return add_scalar(x, c);
      case With::sub:
        return reversed ? add_scalar(neg(x), c) : add_scalar(x, -c);
      case With::mul:
        return scale(x, c);
      case With::div:
        break;
    }
    const Var number = Tensor::full({1}, c, x.dtype());  // times 1 / c has other bits
    return reversed ? div(number, x) : div(x, number);
  });
}

/// A number of Python or NumPy, which takes the type of what is beside it.
bool is_number(const py::object& value) {
  if (PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr())) return true;
  return PyObject_HasAttrString(value.ptr(), "dtype") &&
         py::isinstance(value, py::module_::import("numpy").attr("number"));
}

PyVar with(With how, const PyVar& a, const py::object& other, bool reversed) {
  if (is_number(other)) return with_number(how, a, other.cast<double>(), reversed);
  const DType type = a.var.dtype();
  const PyVar b = var_of(other, &type);
  const Var &x = reversed ? b.var : a.var, &y = reversed ? a.var : b.var;
  return run_op(std::array{&a, &b}, [&] {
    switch (how) {
      case With::add:
        return add(x, y);
      case With::sub:
        return sub(x, y);
      case With::mul:
        return mul(x, y);
      default:
        return div(x, y);
    }
  });
}

template <class Class>
void add_operators(Class& c) {
  const auto op = [&c](const char* name, const char* reversed, With how) {
    c.def(name, [how](const PyVar& a, const py::object& b) { return with(how, a, b, false); });
    c.def(reversed, [how](const PyVar& a, const py::object& b) { return with(how, a, b, true); });
  };
  op("__add__", "__radd__", With::add);
  op("__sub__", "__rsub__", With::sub);
  op("__mul__", "__rmul__", With::mul);
  op("__truediv__", "__rtruediv__", With::div);
  c.def("__neg__",
        [](const PyVar& a) { return run_op(std::array{&a}, [&] { return neg(a.var); }); });
  c.attr("__array_ufunc__") = py::none();  // array + var is ours, not NumPy's
}

void add_parameter(py::module_& m) {
  py::class_<Parameter, PyParameter>(m, "Parameter",
                                     "A trainable tensor; Tape.leaf() makes it a value.")
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
           [](const Parameter& p) { return "Parameter(" + p.value.shape().str() + ")"; });
}

void add_var(py::module_& m) {
  py::class_<PyVar> var(m, "Var", "A value, and its place on a tape if it depends on a leaf.");
  var.def_property_readonly(
         "value", [](const PyVar& v) { return v.var.value; }, "a Tensor, shared")
      .def_property_readonly("shape", [](const PyVar& v) { return tuple_of(v.var.shape()); })
      .def_property_readonly("dtype", [](const PyVar& v) { return name_of(v.var.dtype()); })
      .def_property_readonly("on_tape", [](const PyVar& v) { return v.var.on_tape(); })
      .def(
          "numpy", [](const PyVar& v) { return array_of(v.var.value); }, "A read-only view.")
      .def(
          "__array__",
          [](const PyVar& v, const py::object& dtype, const py::object&) -> py::object {
            const py::array out = array_of(v.var.value);
            return dtype.is_none() ? py::object(out)
                                   : out.attr("astype")(dtype, py::arg("copy") = false);
          },
          py::arg("dtype") = py::none(), py::arg("copy") = py::none())
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
      .def("__len__", [](const PyVar& v) { return v.var.rank() == 0 ? int64_t{0} : v.var.size(0); })
      .def("__repr__", [](const PyVar& v) {
        return "Var(" + v.var.shape().str() + (v.var.on_tape() ? ", on a tape)" : ")");
      });
  add_operators(var);
}

}  // namespace

const Tensor* PyGradients::find(const py::handle& of) const {
  if (py::isinstance<PyVar>(of)) {
    const auto& v = of.cast<const PyVar&>();
    return v.leaf != 0 ? gradients.find(v.leaf) : gradients.find(v.var);
  }
  if (py::isinstance<Parameter>(of)) return gradients.find(of.cast<PyParameter>()->id);
  throw ShapeError(
      "gradients are those of leaves: give a Var of Tape.leaf(), a Parameter, or a Var "
      "whose gradient was kept");
}

PyVar var_of(const py::handle& value, const DType* like) {
  if (py::isinstance<PyVar>(value)) return value.cast<PyVar>();
  if (py::isinstance<Parameter>(value))
    throw ShapeError("a parameter is no value yet; give Tape.leaf(parameter) or its .value");
  Tensor t = tensor_of(value);
  // A plain number or list of Python is float64 to NumPy; beside a value it is of that one's type.
  const bool plain =
      !py::isinstance<Tensor>(value) && !PyObject_HasAttrString(value.ptr(), "dtype");
  if (like != nullptr && plain) t = t.cast(*like);
  return {Var(std::move(t)), nullptr, 0};
}

void add_tape(py::module_& m) {
  add_parameter(m);
  add_var(m);
  py::class_<PyGradients>(m, "Gradients", "What backward() gives: gradients by leaf.")
      .def(
          "__getitem__",
          [](const PyGradients& g, const py::object& of) -> py::object {
            const Tensor* found = g.find(of);
            return found == nullptr ? py::none() : py::cast(*found);
          },
          "The gradient of a leaf, a parameter, or a Var after keep_gradient(), a Tensor; None if "
          "the "
          "loss does not depend on it.")
      .def("__len__", [](const PyGradients& g) { return g.gradients.size(); })
      .def(
          "norm", [](const PyGradients& g) { return g.gradients.norm(); }, "Euclidean, over all.")
      .def("finite", [](const PyGradients& g) { return g.gradients.finite(); });
  py::class_<PyTape, std::shared_ptr<PyTape>>(m, "Tape",
                                              R"(Records ops, so that gradients can be computed.

x = tape.leaf(array_or_parameter) is a value to differentiate by; ops on it are recorded;
tape.backward(loss) gives the gradients of all leaves.)")
      .def(py::init<>())
      .def("leaf", &leaf_of, py::arg("value"),
           "A Var to differentiate by; the same parameter always gives the same one.")
      .def(
          "backward",
          [](const std::shared_ptr<PyTape>& tape, const PyVar& loss) {
            if (loss.tape != tape) throw ShapeError("backward: the loss is not on this tape");
            return backward_of(loss);
          },
          py::arg("loss"), "Gradients of all leaves; what was recorded is forgotten.")
      .def("__len__", [](const PyTape& t) { return t.tape.size(); });
}

}  // namespace restage::python
