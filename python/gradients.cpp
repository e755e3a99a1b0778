// restage.Gradients.
#include <cmath>

#include "autograd/ops/elementwise.h"
#include "python/copies.h"
#include "python/var.h"

namespace restage::python {
namespace {

/// The sum; what one of them lacks is zero there.
PyGradients sum_of(const PyGradients& a, const PyGradients& b) {
  const py::gil_scoped_release released;
  PyGradients out;
  out.leaves = a.leaves;
  out.leaves.insert(b.leaves.begin(), b.leaves.end());
  for (const auto& [id, parameter] : out.leaves) {
    const Tensor *x = a.gradients.find(id), *y = b.gradients.find(id);
    if (x != nullptr && y != nullptr)
      out.gradients.set(id, binary(Binary::add, *x, *y));
    else
      out.gradients.set(id, (x != nullptr ? x : y)->clone());
  }
  return out;
}

PyGradients scaled(const PyGradients& g, double factor) {
  if (!std::isfinite(factor))
    throw ShapeError("gradients: the factor " + std::to_string(factor) + " is no number");
  const py::gil_scoped_release released;
  PyGradients out;
  out.leaves = g.leaves;
  for (const auto& [id, parameter] : g.leaves)
    out.gradients.set(id, scale(Var(*g.gradients.find(id)), factor).value);
  return out;
}

/// sum([g1, g2]) of Python begins with 0.
PyGradients added_to(const PyGradients& g, const py::object& other) {
  if (!PyLong_Check(other.ptr()) || other.cast<int64_t>() != 0)
    throw py::type_error("gradients are added to gradients");
  return g;
}

/// Parameters that the loss depends on, in the order in which they were made, with gradients.
std::vector<std::pair<PyParameter, Tensor>> items(const PyGradients& g) {
  std::vector<std::pair<PyParameter, Tensor>> out;
  for (const auto& [id, parameter] : g.leaves)
    if (parameter) out.emplace_back(parameter, *g.gradients.find(id));
  return out;
}

py::object gradient_of(const PyGradients& g, const py::object& of) {
  const Tensor* found = g.find(of);
  return found == nullptr ? py::none() : py::cast(*found);
}

}  // namespace

PyGradients gradients_of(Gradients gradients, std::map<uint64_t, PyParameter> leaves) {
  std::erase_if(leaves, [&](const auto& leaf) { return gradients.find(leaf.first) == nullptr; });
  return {std::move(gradients), std::move(leaves)};
}

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

void add_gradients(py::module_& m) {
  py::class_<PyGradients> gradients(m, "Gradients",
                                    R"(What backward() gives: gradients by leaf.

g1 + g2 (also sum(list)), 0.5 * g and g / 2 are Gradients of the leaves, where a leaf that one of them lacks counts
as zero; gradients of keep_gradient() are left out. for parameter in g goes through the Parameters that have one.)");
  refuse_copies(gradients,
                "Gradients cannot be copied or pickled, as they know their leaves in this process "
                "only: take those you need, such as gradients[x], which is a Tensor");
  gradients.attr("__array_ufunc__") = py::none();  // a number of NumPy times gradients is ours
  gradients
      .def("__getitem__", &gradient_of,
           "The gradient of a leaf, a parameter, or a Var after keep_gradient(), a Tensor; None if "
           "the loss does not depend on it.")
      .def("__contains__",
           [](const PyGradients& g, const py::object& of) { return g.find(of) != nullptr; })
      .def("__len__", [](const PyGradients& g) { return g.gradients.size(); })
      .def("__iter__",
           [](const PyGradients& g) {
             py::list parameters;
             for (const auto& [parameter, gradient] : items(g)) parameters.append(parameter);
             return py::iter(parameters);
           })
      .def("items", &items, "[(Parameter, Tensor)]: leaves that are no Parameter are left out.")
      .def("__add__", &sum_of, py::is_operator())
      .def("__radd__", &added_to, py::is_operator())
      .def("__mul__", &scaled, py::is_operator())
      .def("__rmul__", &scaled, py::is_operator())
      .def(
          "__truediv__",
          [](const PyGradients& g, double by) {
            if (by == 0) throw ShapeError("gradients: divided by zero");
            return scaled(g, 1 / by);
          },
          py::is_operator())
      .def(
          "norm", [](const PyGradients& g) { return g.gradients.norm(); }, "Euclidean, over all.")
      .def("finite", [](const PyGradients& g) { return g.gradients.finite(); });
}

}  // namespace restage::python
