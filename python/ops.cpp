// restage.ops: element-wise ops, layout, products, sums.
#include "python/ops.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "python/engine.h"

namespace restage::python {
namespace {

using O = py::object;

template <class F>
void unary(py::module_& m, const char* name, const char* doc, F f) {
  m.def(
      name, [f](const O& x) { return op_of(f, x); }, py::arg("x"), doc);
}
template <class F>
void unary(py::module_& m, const char* name, const char* number, const char* doc, F f) {
  m.def(
      name, [f](const O& x, double c) { return op_of([&](const Var& v) { return f(v, c); }, x); },
      py::arg("x"), py::arg(number), doc);
}
template <class F>
void binary_op(py::module_& m, const char* name, const char* doc, F f, const char* first = "a",
               const char* second = "b") {
  m.def(
      name, [f](const O& a, const O& b) { return op_of(f, a, b); }, py::arg(first), py::arg(second),
      doc);
}

RngKey key_of(uint64_t seed, uint64_t stream) { return RngKey{seed, stream}.fold("python"); }

void check_rate(double p) {
  if (!(p >= 0 && p < 1)) throw ShapeError("dropout: p must be in [0, 1)");
}

void add_elementwise(py::module_& m) {
#define RESTAGE_BIND(name, help, ...) unary(m, #name, help, [](const Var& x) { return name(x); });
  RESTAGE_UNARY(RESTAGE_BIND)
#undef RESTAGE_BIND
#define RESTAGE_BIND(name, number, tried, help, ...) \
  unary(m, #name, #number, help, [](const Var& x, double c) { return name(x, c); });
  RESTAGE_UNARY_WITH_NUMBER(RESTAGE_BIND)
#undef RESTAGE_BIND
#define RESTAGE_BIND(name, a, b, help, ...) \
  binary_op(                                \
      m, #name, help, [](const Var& p, const Var& q) { return name(p, q); }, #a, #b);
  RESTAGE_BINARY(RESTAGE_BIND)
#undef RESTAGE_BIND
  m.def(
      "expand",
      [](const O& x, const O& shape) {
        return op_of([s = shape_of(shape)](const Var& v) { return expand(v, s); }, x);
      },
      py::arg("x"), py::arg("shape"), "x repeated to a larger shape, as NumPy broadcasts");
  const auto drop = [&m](const char* name, const char* doc, auto f) {
    m.def(
        name,
        [f](const O& x, double p, uint64_t seed, uint64_t stream) {
          check_rate(p);
          return op_of([&](const Var& v) { return f(v, p, key_of(seed, stream)); }, x);
        },
        py::arg("x"), py::arg("p"), py::arg("seed") = 0, py::arg("stream") = 0, doc);
  };
  drop("dropout",
       "Keeps each element with probability 1 - p, divided by it; the mask is a function of seed "
       "and stream.",
       [](const Var& x, double p, RngKey key) { return dropout(x, p, key); });
  drop("relu_dropout", "dropout(relu(x)) in one pass.",
       [](const Var& x, double p, RngKey key) { return relu_dropout(x, p, key); });
}

Axes axes_of(const std::vector<int>& order, int rank) {
  if (order.size() > Shape::kMaxRank) throw ShapeError("permute: more than six axes");
  Axes out;
  for (const int axis : order) out.push_back(axis < 0 ? axis + rank : axis);
  return out;
}

PyVar concat_of(const std::vector<py::object>& xs, int axis) {
  if (xs.empty()) throw ShapeError("concat: needs at least one tensor");
  std::vector<PyVar> vars;
  std::vector<const PyVar*> pointers;
  std::vector<Var> values;
  for (const O& x : xs) vars.push_back(var_of(x));
  for (const PyVar& v : vars) pointers.push_back(&v), values.push_back(v.var);
  return run_op(pointers, [&] { return concat(std::span<const Var>(values), axis); });
}

std::vector<PyVar> split_of(const O& x, int axis, const std::vector<int64_t>& sizes) {
  if (sizes.size() > kMaxInputs)
    throw ShapeError("split: at most " + std::to_string(kMaxInputs) + " parts");
  Split op{axis, {}};
  for (const int64_t size : sizes) op.sizes.push_back(size);
  const PyVar whole = var_of(x);
  Vars parts;
  const PyVar first = run_op(std::array{&whole}, [&] {
    parts = call(op, {whole.var});
    return parts[0];
  });
  std::vector<PyVar> out;
  for (const Var& part : parts) out.push_back({part, first.tape});
  return out;
}

void add_layout(py::module_& m) {
  m.def(
      "reshape",
      [](const O& x, const O& shape) {
        return op_of([s = shape_of(shape)](const Var& v) { return reshape(v, s); }, x);
      },
      py::arg("x"), py::arg("shape"), "The same numbers under another shape; one size may be -1.");
  m.def(
      "permute",
      [](const O& x, const std::vector<int>& order) {
        return op_of([&](const Var& v) { return permute(v, axes_of(order, v.rank())); }, x);
      },
      py::arg("x"), py::arg("order"), "Axis i of the result is axis order[i] of x.");
  m.def(
      "slice",
      [](const O& x, int axis, int64_t from, int64_t to) {
        return op_of([&](const Var& v) { return slice(v, axis, from, to); }, x);
      },
      py::arg("x"), py::arg("axis"), py::arg("start"), py::arg("stop"),
      "Elements [start, stop) along an axis.");
  m.def("split", &split_of, py::arg("x"), py::arg("axis"), py::arg("sizes"),
        "The parts of these sizes along an axis; the sizes add up to its size.");
  m.def("concat", &concat_of, py::arg("xs"), py::arg("axis"), "Joins tensors along an axis.");
  m.def(
      "repeat_items",
      [](const O& x, int64_t times) {
        return op_of(
            [&](const Var& v) {
              if (v.rank() != 3 || times < 0 || times > (int64_t{1} << 40))
                throw ShapeError("repeat_items: x[n, v, c] and times >= 0; got " + v.shape().str());
              return repeat_items(v, times);
            },
            x);
      },
      py::arg("x"), py::arg("times"),
      "[n, v, c] -> [n times, v, c]: every item `times` times in a row.");
  m.def(
      "gather",
      [](const O& x, const O& index) {
        return op_of([i = index_of(index)](const Var& v) { return gather(v, i); }, x);
      },
      py::arg("x"), py::arg("index"),
      "Rows of x [n, v, c] by an index of integers [n, ...] -> [n, ..., c].");
  m.def(
      "scatter_add",
      [](const O& x, const O& index, int64_t rows) {
        return op_of([i = index_of(index), rows](const Var& v) { return scatter_add(v, i, rows); },
                     x);
      },
      py::arg("x"), py::arg("index"), py::arg("rows"),
      "Rows of x [n, m, c] added into `rows` rows by an index [n, m].");
  m.def(
      "unfold",
      [](const O& x, int64_t k, int64_t stride, int64_t pad_left, int64_t steps) {
        return op_of(
            [&](const Var& v) {
              return Var(call(Unfold{k, stride, pad_left, steps}, {v}));
            },
            x);
      },
      py::arg("x"), py::arg("k"), py::arg("stride"), py::arg("pad_left"), py::arg("steps"),
      "Windows of a sequence: x [n, l, c] -> [n, steps, c k].");
  m.def(
      "conv1d",
      [](const O& x, const O& w, const O& b, int64_t stride, int64_t pad_left, int64_t steps) {
        return op_of(
            [&](const Var& xv, const Var& wv, const Var& bv) {
              if (xv.rank() != 3 || wv.rank() != 3)
                throw ShapeError("conv1d: x[n, l, c], weight[o, c, k], bias[o]; got " +
                                 xv.shape().str() + " and " + wv.shape().str());
              return conv1d(xv, wv, bv, stride, pad_left, steps);
            },
            x, w, b);
      },
      py::arg("x"), py::arg("weight"), py::arg("bias"), py::arg("stride"), py::arg("pad_left"),
      py::arg("steps"),
      "x [n, l, c], weight [o, c, k], bias [o] -> [n, steps, o]; outside of the sequence is 0.");
}

void add_linear(py::module_& m) {
  m.def(
      "linear",
      [](const O& x, const O& w, const O& b, const std::string& activation) {
        const Activation act = activation_of(activation);
        if (b.is_none())
          return op_of(
              [&](const Var& xv, const Var& wv) {
                return Var(call(LinearOp{act}, {xv, wv}));
              },
              x, w);
        return op_of(
            [&](const Var& xv, const Var& wv, const Var& bv) { return linear(xv, wv, bv, act); }, x,
            w, b);
      },
      py::arg("x"), py::arg("weight"), py::arg("bias") = py::none(), py::arg("activation") = "none",
      "activation(x W^T + b): x [..., i], W [o, i], b [o]; activation: none, relu ...");
  m.def(
      "matmul",
      [](const O& a, const O& b, bool ta, bool tb) {
        return op_of([&](const Var& av, const Var& bv) { return matmul(av, bv, ta, tb); }, a, b);
      },
      py::arg("a"), py::arg("b"), py::arg("transpose_a") = false, py::arg("transpose_b") = false,
      "a [b?, m, k] times b [b?, k, n]; a matrix without the first axis is shared.");
}

void add_reduce(py::module_& m) {
  const auto along = [&m](const char* name, const char* doc, auto f) {
    m.def(
        name,
        [f](const O& x, int axis) {
          return op_of(
              [&](const Var& v) {
                if (axis >= v.rank() || axis < -v.rank())
                  throw ShapeError("there is no axis " + std::to_string(axis) + " in " +
                                   v.shape().str());
                return f(v, axis);
              },
              x);
        },
        py::arg("x"), py::arg("axis") = -1, doc);
  };
  along("sum", "Sum over one axis, which is removed.",
        [](const Var& x, int axis) { return sum(x, axis); });
  along("max", "Largest along one axis, which is removed.",
        [](const Var& x, int axis) { return max(x, axis); });
  along("softmax", "Softmax along one axis.",
        [](const Var& x, int axis) { return softmax(x, axis); });
  along("mean", "Mean over one axis, which is removed.",
        [](const Var& x, int axis) { return mean(x, axis); });
  unary(m, "sum_all", "Sum of all elements, [1].", [](const Var& x) { return sum_all(x); });
  unary(m, "mean_all", "Mean of all elements, [1].", [](const Var& x) { return mean_all(x); });
  binary_op(m, "mse", "Mean squared error of two equal shapes, [1].",
            [](const Var& a, const Var& b) {
              if (!(a.shape() == b.shape()))
                throw ShapeError("mse: shapes differ; got " + a.shape().str() + " and " +
                                 b.shape().str());
              return mse(a, b);
            });
  m.def(
      "smooth_length",
      [](const O& x, double epsilon) {
        check_not_negative("smooth_length", "epsilon", epsilon);
        return op_of([&](const Var& v) { return smooth_length(v, epsilon); }, x);
      },
      py::arg("x"), py::arg("epsilon"),
      "sqrt(|x|^2 + epsilon) along the last axis, which is removed.");
  m.def(
      "bce_with_logits",
      [](const O& x, double label) {
        if (!(label >= 0 && label <= 1))
          throw ShapeError("bce_with_logits: the label must be in [0, 1]");
        return op_of([&](const Var& v) { return bce_with_logits(v, label); }, x);
      },
      py::arg("logits"), py::arg("label"),
      "Mean binary cross-entropy against a label in [0, 1], [1].");
}

}  // namespace

void check_not_negative(const char* op, const char* name, double value) {
  if (!(value >= 0))
    throw ShapeError(std::string(op) + ": " + name + " is " + std::to_string(value) +
                     ", and must not be negative");
}

Activation activation_of(const std::string& name) {
  const auto names = activations();
  for (size_t i = 0; i < names.size(); ++i)
    if (name == names[i]) return static_cast<Activation>(i);
  throw ShapeError("activation '" + name.substr(0, 40) + "' is unknown");
}

void add_ops(py::module_& m) {
  py::module_ ops = m.def_submodule("ops", "Every op of the engine; names and shapes as in C++.");
  add_elementwise(ops);
  add_layout(ops);
  add_linear(ops);
  add_reduce(ops);
  add_network_ops(ops);
  add_body_ops(ops);
}

}  // namespace restage::python
