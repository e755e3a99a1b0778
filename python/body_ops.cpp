// restage.ops: rotations, skeletons, skinning.
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"
#include "nn/models/motion.h"
#include "python/engine.h"
#include "python/ops.h"

namespace restage::python {
namespace {

using O = py::object;

/// Parents of joints; None: those of the 22.
std::vector<int> parents_of(const O& parents) {
  if (parents.is_none()) return {joint_parents().begin(), joint_parents().end()};
  const Tensor t = index_of(parents);
  return {t.data<int32_t>(), t.data<int32_t>() + t.numel()};
}

/// [j, 4]: parent, child, left, right of each joint; None: those of the 22.
std::vector<SwingJoint> swings_of(const O& joints) {
  if (joints.is_none()) return {joint_swings().begin(), joint_swings().end()};
  const Tensor t = index_of(joints);
  if (t.rank() != 2 || t.size(1) != 4)
    throw ShapeError("swing_twist: joints are [j, 4]: parent, child, left, right; -1 for none");
  std::vector<SwingJoint> out;
  for (int64_t i = 0; i < t.size(0); ++i) {
    const int32_t* row = t.data<int32_t>() + 4 * i;
    for (int k = 0; k < 4; ++k)
      if (row[k] < -1) throw ShapeError("swing_twist: a joint is below -1");
    out.push_back({row[0], row[1], row[2], row[3]});
  }
  return out;
}

/// -1 is the root; what is further below would be read before the list.
std::vector<int> checked(std::vector<int> parents) {
  for (const int p : parents)
    if (p < -1) throw ShapeError("forward_kinematics: a parent is below -1");
  return parents;
}

void check_matrices(const char* name, const Shape& shape) {
  if (shape.rank() < 2 || shape[-1] != 3 || shape[-2] != 3)
    throw ShapeError(std::string(name) + ": r[..., 3, 3]; got " + shape.str());
}
void check_transforms(const char* name, const Shape& shape) {
  if (shape.rank() != 4 || shape[2] != 3 || shape[3] != 4)
    throw ShapeError(std::string(name) + ": T[n, j, 3, 4]; got " + shape.str());
}

void add_forms(py::module_& m) {
  m.def(
      "sixd_to_matrix",
      [](const O& x) { return op_of([](const Var& v) { return sixd_to_matrix(v); }, x); },
      py::arg("x"), "[..., 6], two columns, not orthonormal -> [..., 3, 3]");
  m.def(
      "quaternion_to_matrix",
      [](const O& x) { return op_of([](const Var& v) { return quaternion_to_matrix(v); }, x); },
      py::arg("x"), "[..., 4], w x y z, normalised here -> [..., 3, 3]");
  m.def(
      "axis_angle_to_matrix",
      [](const O& x) { return op_of([](const Var& v) { return axis_angle_to_matrix(v); }, x); },
      py::arg("x"), "[..., 3], radians -> [..., 3, 3]");
  m.def(
      "matrix_to_sixd",
      [](const O& r) {
        return op_of(
            [](const Var& v) {
              check_matrices("matrix_to_sixd", v.shape());
              return matrix_to_sixd(v);
            },
            r);
      },
      py::arg("r"), "[..., 3, 3] -> [..., 6], the first two columns");
  const auto from_matrix = [&m](const char* name, const char* doc, Tensor (*f)(const Tensor&)) {
    m.def(
        name,
        [name, f](const O& r) {
          const Tensor t = tensor_of(r);
          check_matrices(name, t.shape());
          const py::gil_scoped_release released;
          return f(t);
        },
        py::arg("r"), doc);
  };
  from_matrix("matrix_to_quaternion", "[..., 3, 3] -> [..., 4], w >= 0; no gradient",
              &matrix_to_quaternion);
  from_matrix("matrix_to_axis_angle", "[..., 3, 3] -> [..., 3], radians; no gradient",
              &matrix_to_axis_angle);
}

void add_skeletons(py::module_& m) {
  m.def(
      "forward_kinematics",
      [](const O& local, const O& rest, const O& root, const O& parents) {
        const std::vector<int> tree = checked(parents_of(parents));
        return op_of([&](const Var& l, const Var& r,
                         const Var& o) { return forward_kinematics(l, r, o, tree); },
                     local, rest, root);
      },
      py::arg("local"), py::arg("rest"), py::arg("root"), py::arg("parents") = py::none(),
      "Local rotations [n, j, 3, 3], rest joints [n, j, 3], root [n, 3], metres -> [n, j, 3, 4]: "
      "global rotation | position. parents: -1 for the root; None: the 22 joints'.");
  const auto part = [&m](const char* name, const char* doc, Var (*f)(const Var&)) {
    m.def(
        name,
        [name, f](const O& t) {
          return op_of(
              [&](const Var& v) {
                check_transforms(name, v.shape());
                return f(v);
              },
              t);
        },
        py::arg("transforms"), doc);
  };
  part("joints_of", "Positions [n, j, 3] of forward_kinematics().",
       [](const Var& v) { return restage::joints_of(v); });
  part("rotations_of", "Global rotations [n, j, 3, 3] of forward_kinematics().",
       [](const Var& v) { return rotations_of(v); });
  m.def(
      "linear_blend_skinning",
      [](const O& points, const O& weights, const O& transforms, const O& rest) {
        return op_of([](const Var& p, const Var& w, const Var& t,
                        const Var& r) { return linear_blend_skinning(p, w, t, r); },
                     points, weights, transforms, rest);
      },
      py::arg("points"), py::arg("weights"), py::arg("transforms"), py::arg("rest"),
      "points [n, v, 3], weights [n, v, j], transforms [n, j, 3, 4], rest joints [n, j, 3] -> "
      "[n, v, 3], metres");
  m.def(
      "swing_twist",
      [](const O& rest, const O& posed, const O& twist, const O& joints) {
        const std::vector<SwingJoint> swings = swings_of(joints);
        return op_of(
            [&](const Var& r, const Var& p, const Var& t) { return swing_twist(r, p, t, swings); },
            rest, posed, twist);
      },
      py::arg("rest"), py::arg("posed"), py::arg("twist"), py::arg("joints") = py::none(),
      "Rest and posed joints [n, j, 3], twist about each posed bone [n, j] in radians -> local "
      "rotations [n, j, 3, 3]. joints [j, 4]: parent, child, left, right, -1 for none; None: the "
      "22 joints.");
}

}  // namespace

void add_body_ops(py::module_& ops) {
  add_forms(ops);
  add_skeletons(ops);
}

}  // namespace restage::python
