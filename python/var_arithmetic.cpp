// Operators of restage.Var.
#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "python/arrays.h"
#include "python/var.h"

namespace restage::python {
namespace {

enum class With { add, sub, mul, div, pow };

/// c x^(c - 1) would be 0 / 0 at zero where c is 0.
Var power_of(const Var& x, double c) {
  if (c == 0) return add_scalar(scale(x, 0), 1);
  if (c == 2) return square(x);
  return pow(x, Tensor::full(Shape(), c, x.dtype()));
}

/// A number beside a value: the ops that take one.
Var with_number(With how, const Var& x, double c, bool reversed) {
  switch (how) {
    case With::add:
      return add_scalar(x, c);
    case With::sub:
      return reversed ? add_scalar(neg(x), c) : add_scalar(x, -c);
    case With::mul:
      return scale(x, c);
    case With::pow:
      return reversed ? pow(Tensor::full(Shape(), c, x.dtype()), x) : power_of(x, c);
    case With::div:
      break;
  }
  const Var number = Tensor::full(Shape(), c, x.dtype());  // times 1 / c has other bits
  return reversed ? div(number, x) : div(x, number);
}

Var of_two(With how, const Var& x, const Var& y) {
  switch (how) {
    case With::add:
      return add(x, y);
    case With::sub:
      return sub(x, y);
    case With::mul:
      return mul(x, y);
    case With::pow:
      return pow(x, y);
    case With::div:
      break;
  }
  return div(x, y);
}

/// A number of Python or NumPy, which takes the type of what is beside it.
bool is_number(const py::object& value) {
  if (PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr())) return true;
  return PyObject_HasAttrString(value.ptr(), "dtype") &&
         py::isinstance(value, py::module_::import("numpy").attr("number"));
}

/// work(x, y) of a value and of what stands beside it, in the order in which they were typed.
template <class Work>
PyVar with_other(const PyVar& a, const py::object& other, bool reversed, const Work& work) {
  const PyVar left = as_seen(a);
  const DType type = a.var.dtype();
  const PyVar b = var_of(other, &type);
  const Var &x = reversed ? b.var : left.var, &y = reversed ? left.var : b.var;
  return run_op(std::array{&left, &b}, [&] { return Var(work(x, y)); });
}

PyVar with(With how, const PyVar& a, const py::object& other, bool reversed) {
  if (is_number(other)) {
    const double c = other.cast<double>();
    return on_value(a, [&](const Var& x) { return with_number(how, x, c, reversed); });
  }
  return with_other(a, other, reversed,
                    [how](const Var& x, const Var& y) { return of_two(how, x, y); });
}

// ---- @ ------------------------------------------------------------------------------------------

/// The axes before the matrix.
Shape batch_of(const Var& x) {
  Shape out;
  for (int i = 0; i + 2 < x.rank(); ++i) out.push_back(x.size(i));
  return out;
}

Shape joined(Shape batch, int64_t rows, int64_t columns) {
  batch.push_back(rows);
  batch.push_back(columns);
  return batch;
}

/// [batch..., m, k] as [all of the batch, m, k], repeated where the other one's batch is larger.
Var flat_batch(const Var& x, const Shape& batch) {
  const int64_t m = x.size(-2), k = x.size(-1);
  const Shape whole = joined(batch, m, k);
  return reshape(x.shape() == whole ? x : expand(x, whole), {batch.numel(), m, k});
}

/// NumPy's rules: a vector is a row on the left and a column on the right, axes before the last two
/// are broadcast.
Var product(const Var& a, const Var& b) {
  const auto refuse = [&](const char* why) {
    throw ShapeError("@: " + a.shape().str() + " @ " + b.shape().str() + ": " + why);
  };
  if (a.rank() == 0 || b.rank() == 0) refuse("a single number is no matrix; use *");
  const Var x = a.rank() == 1 ? reshape(a, {1, a.size(0)}) : a;
  const Var y = b.rank() == 1 ? reshape(b, {b.size(0), 1}) : b;
  if (x.size(-1) != y.size(-2))
    refuse("the last axis of the first and the last but one of the second must agree");
  bool fits = true;
  const Shape batch = broadcast_shape(batch_of(x), batch_of(y), &fits);
  if (!fits) refuse("the axes before the last two cannot be broadcast");
  const int64_t m = x.size(-2), n = y.size(-1);
  Var z;
  if (y.rank() == 2)  // shared by all of x: one product of all rows
    z = matmul(reshape(x, {batch.numel() * m, x.size(-1)}), y);
  else
    z = matmul(x.rank() == 2 ? x : flat_batch(x, batch), flat_batch(y, batch));
  Shape out = batch;
  if (a.rank() > 1) out.push_back(m);
  if (b.rank() > 1) out.push_back(n);
  return z.shape() == out ? z : reshape(z, out);
}

// ---- comparisons --------------------------------------------------------------------------------

enum class Comparison { less, less_equal, greater, greater_equal, equal, not_equal };

template <class T>
bool holds(Comparison how, T a, T b) {
  switch (how) {
    case Comparison::less:
      return a < b;
    case Comparison::less_equal:
      return a <= b;
    case Comparison::greater:
      return a > b;
    case Comparison::greater_equal:
      return a >= b;
    case Comparison::equal:
      return a == b;
    case Comparison::not_equal:
      break;
  }
  return a != b;
}

template <class T>
void compare_all(Comparison how, const Tensor& a, const Tensor& b, Tensor* out) {
  const T *x = a.data<T>(), *y = b.data<T>();
  T* to = out->data<T>();
  for (int64_t i = 0; i < out->numel(); ++i) to[i] = holds(how, x[i], y[i]) ? T{1} : T{0};
}

/// 1 where it holds and 0 elsewhere, of the inputs' type, broadcast; a constant.
Var compared(Comparison how, const Var& a, const Var& b) {
  if (a.dtype() != b.dtype() || (a.dtype() != DType::f32 && a.dtype() != DType::f64))
    throw ShapeError(std::string("comparison: of ") + name_of(a.dtype()) + " and " +
                     name_of(b.dtype()) + "; both sides are float32, or both float64");
  bool fits = true;
  const Shape shape = broadcast_shape(a.shape(), b.shape(), &fits);
  if (!fits)
    throw ShapeError("comparison: " + a.shape().str() + " and " + b.shape().str() +
                     " cannot be broadcast");
  const auto whole = [&](const Var& v) {
    return v.shape() == shape ? v.value.cpu() : expand(Var(v.value.cpu()), shape).value;
  };
  const Tensor x = whole(a), y = whole(b);
  Tensor out = Tensor::empty(shape, a.dtype());
  if (a.dtype() == DType::f32)
    compare_all<float>(how, x, y, &out);
  else
    compare_all<double>(how, x, y, &out);
  return Var(out);
}

/// Whether a value can stand beside ours: text and None cannot, nor other objects.
bool is_comparable(const py::object& other) {
  return is_number(other) || py::isinstance<PyVar>(other) || py::isinstance<Tensor>(other) ||
         py::isinstance<Parameter>(other) || py::isinstance<py::list>(other) ||
         py::isinstance<py::tuple>(other) || PyObject_HasAttrString(other.ptr(), "__array__") ||
         lends_memory(other);
}

py::object compare(Comparison how, const PyVar& a, const py::object& other) {
  if (py::isinstance<py::str>(other) || py::isinstance<py::bytes>(other) || !is_comparable(other))
    return py::reinterpret_borrow<py::object>(Py_NotImplemented);
  const PyVar left{a.var.detach(), nullptr, 0};
  const DType type = a.var.dtype();
  const PyVar right{is_number(other) ? Var(Tensor::full(Shape(), other.cast<double>(), type))
                                     : var_of(other, &type).var.detach(),
                    nullptr, 0};
  return py::cast(
      run_op(std::array{&left, &right}, [&] { return compared(how, left.var, right.var); }));
}

/// Of a single number; of others nobody could say.
bool truth(const PyVar& v) {
  if (v.var.value.numel() != 1)
    throw ShapeError("a Var of " + v.var.shape().str() +
                     " is neither true nor false; use v.numpy().any() or v.numpy().all()");
  return v.var.value.cpu().item() != 0;
}

}  // namespace

void add_arithmetic(VarClass& c) {
  const auto op = [&c](const char* name, const char* reversed, With how) {
    c.def(name, [how](const PyVar& a, const py::object& b) { return with(how, a, b, false); });
    c.def(reversed, [how](const PyVar& a, const py::object& b) { return with(how, a, b, true); });
  };
  op("__add__", "__radd__", With::add);
  op("__sub__", "__rsub__", With::sub);
  op("__mul__", "__rmul__", With::mul);
  op("__truediv__", "__rtruediv__", With::div);
  op("__pow__", "__rpow__", With::pow);
  c.def("__matmul__",
        [](const PyVar& a, const py::object& b) { return with_other(a, b, false, product); });
  c.def("__rmatmul__",
        [](const PyVar& a, const py::object& b) { return with_other(a, b, true, product); });
  c.def("__neg__", [](const PyVar& a) { return on_value(a, [](const Var& x) { return neg(x); }); });
  c.def("__pos__", [](const PyVar& a) { return as_seen(a); });
  c.def("__abs__", [](const PyVar& a) { return on_value(a, [](const Var& x) { return abs(x); }); });
  const auto comparison = [&c](const char* name, Comparison how) {
    c.def(name, [how](const PyVar& a, const py::object& b) { return compare(how, a, b); });
  };
  comparison("__lt__", Comparison::less);
  comparison("__le__", Comparison::less_equal);
  comparison("__gt__", Comparison::greater);
  comparison("__ge__", Comparison::greater_equal);
  comparison("__eq__", Comparison::equal);
  comparison("__ne__", Comparison::not_equal);
  // == compares numbers, and a Var is still a key of a dict.
  c.attr("__hash__") = py::module_::import("builtins").attr("object").attr("__hash__");
  c.def("__bool__", &truth);
  c.def("__float__", [](const PyVar& v) {
    if (v.var.value.numel() != 1) throw py::type_error("float: the value is no single number");
    return v.var.value.cpu().item();
  });
  c.attr("__array_ufunc__") = py::none();  // array + var is ours, not NumPy's
}

}  // namespace restage::python
