// Methods of restage.Var: sums, means, layout.
#include <algorithm>

#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "python/var.h"

namespace restage::python {
namespace {

/// Axes as NumPy takes them: None (all), an integer, or a tuple. Sorted, each once.
std::vector<int> reduced_axes(const py::object& axis, int rank) {
  std::vector<int> out;
  if (axis.is_none()) {
    for (int i = 0; i < rank; ++i) out.push_back(i);
    return out;
  }
  const py::tuple axes =
      py::isinstance<py::sequence>(axis) ? py::tuple(axis) : py::make_tuple(axis);
  for (const py::handle one : axes) {
    if (!PyIndex_Check(one.ptr()) || PyBool_Check(one.ptr()))
      throw ShapeError("axis: give an integer, a tuple of integers, or None for all");
    const py::ssize_t i = PyNumber_AsSsize_t(one.ptr(), nullptr);
    if (i < -rank || i >= rank)
      throw ShapeError("axis: there is no axis " + std::to_string(i) + " of " +
                       std::to_string(rank));
    out.push_back(static_cast<int>(i < 0 ? i + rank : i));
  }
  std::sort(out.begin(), out.end());
  if (std::adjacent_find(out.begin(), out.end()) != out.end())
    throw ShapeError("axis: the same axis twice");
  return out;
}

Shape shape_without(const Shape& shape, const std::vector<int>& axes, bool keepdims) {
  Shape out;
  for (int i = 0; i < shape.rank(); ++i) {
    const bool gone = std::binary_search(axes.begin(), axes.end(), i);
    if (!gone || keepdims) out.push_back(gone ? 1 : shape[i]);
  }
  return out;
}

/// `all` reduces a whole value, `along` one axis.
template <class All, class Along>
PyVar reduced(const PyVar& v, const py::object& axis, bool keepdims, const All& all,
              const Along& along) {
  const std::vector<int> axes = reduced_axes(axis, v.var.rank());
  const Shape shape = shape_without(v.var.shape(), axes, keepdims);
  return on_value(v, [&](const Var& x) {
    Var y = x;
    if (axes.size() > 1 && std::ssize(axes) == x.rank()) {
      y = all(x);
    } else {
      for (auto one = axes.rbegin(); one != axes.rend(); ++one) y = along(y, *one);
    }
    return y.shape() == shape ? y : reshape(y, shape);
  });
}

Var largest_of_all(const Var& x) { return max(reshape(x, {x.value.numel()}), 0); }

/// np.sum(v) and the like call these methods with arguments of their own.
void only_none(const py::object& dtype, const py::object& out) {
  if (!dtype.is_none() || !out.is_none())
    throw py::type_error("dtype and out cannot be given for a Var");
}

template <class All, class Along>
void add_reduction(VarClass& var, const char* name, const char* doc, All all, Along along) {
  var.def(
      name,
      [all, along](const PyVar& v, const py::object& axis, bool keepdims, const py::object& dtype,
                   const py::object& out) {
        only_none(dtype, out);
        return reduced(v, axis, keepdims, all, along);
      },
      py::arg("axis") = py::none(), py::arg("keepdims") = false, py::kw_only(),
      py::arg("dtype") = py::none(), py::arg("out") = py::none(), doc);
}

PyVar reshaped(const PyVar& v, const py::args& sizes, const std::string& order) {
  if (order != "C") throw ShapeError("reshape: order is 'C'");
  const Shape shape = shape_of(sizes.size() == 1 ? py::object(sizes[0]) : py::object(sizes));
  return on_value(v, [&](const Var& x) { return reshape(x, shape); });
}

PyVar permuted(const PyVar& v, std::vector<int> order) {
  const int rank = v.var.rank();
  if (static_cast<int>(order.size()) != rank)
    throw ShapeError("transpose: names " + std::to_string(order.size()) + " axes, and " +
                     v.var.shape().str() + " has " + std::to_string(rank) +
                     "; swapaxes(a, b) exchanges two");
  Axes axes;
  for (const int axis : order) axes.push_back(axis < 0 ? axis + rank : axis);
  return on_value(v, [&](const Var& x) { return permute(x, axes); });
}

std::vector<int> backwards(int rank) {
  std::vector<int> out;
  for (int i = rank; i > 0; --i) out.push_back(i - 1);
  return out;
}

PyVar transposed(const PyVar& v, const py::args& axes) {
  if (axes.empty() || (axes.size() == 1 && axes[0].is_none()))
    return permuted(v, backwards(v.var.rank()));
  const bool listed = axes.size() == 1 && py::isinstance<py::sequence>(axes[0]);
  return permuted(v, (listed ? py::object(axes[0]) : py::object(axes)).cast<std::vector<int>>());
}

PyVar swapped(const PyVar& v, int a, int b) {
  std::vector<int> order = backwards(v.var.rank());
  std::reverse(order.begin(), order.end());
  const int rank = v.var.rank();
  for (int* axis : {&a, &b}) {
    if (*axis < -rank || *axis >= rank)
      throw ShapeError("swapaxes: there is no axis " + std::to_string(*axis) + " in " +
                       v.var.shape().str());
    if (*axis < 0) *axis += rank;
  }
  std::swap(order[static_cast<size_t>(a)], order[static_cast<size_t>(b)]);
  return permuted(v, order);
}

}  // namespace

void add_reductions(VarClass& var) {
  add_reduction(
      var, "sum", "Sum of all elements, or along axes (an integer or a tuple).",
      [](const Var& x) { return sum_all(x); }, [](const Var& x, int axis) { return sum(x, axis); });
  add_reduction(
      var, "mean", "Mean of all elements, or along axes (an integer or a tuple).",
      [](const Var& x) { return mean_all(x); },
      [](const Var& x, int axis) { return mean(x, axis); });
  add_reduction(var, "max",
                "Largest of all elements, or along axes; the first of equal ones has the gradient.",
                &largest_of_all, [](const Var& x, int axis) { return max(x, axis); });
  add_reduction(
      var, "min",
      "Smallest of all elements, or along axes; the first of equal ones has the gradient.",
      [](const Var& x) { return neg(largest_of_all(neg(x))); },
      [](const Var& x, int axis) { return neg(max(neg(x), axis)); });
  var.def("reshape", &reshaped, py::arg("order") = "C",
          "v.reshape(2, -1) or v.reshape((2, -1)): the same numbers under another shape.")
      .def("transpose", &transposed,
           "v.transpose() turns the axes around; v.transpose(1, 0, 2): axis i is axis axes[i].")
      .def("swapaxes", &swapped, py::arg("axis1"), py::arg("axis2"), "Exchanges two axes.")
      .def_property_readonly(
          "T", [](const PyVar& v) { return permuted(v, backwards(v.var.rank())); },
          "The axes the other way around, as NumPy's.")
      .def_property_readonly("ndim", [](const PyVar& v) { return v.var.rank(); })
      .def_property_readonly("size", [](const PyVar& v) { return v.var.value.numel(); });
}

}  // namespace restage::python
