// restage.ops: norms, attention, recurrent layers, neighbours of points.
#include "autograd/ops/attention.h"
#include "autograd/ops/cross_attention.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/points.h"
#include "autograd/ops/pooled_norm.h"
#include "autograd/ops/rnn.h"
#include "autograd/ops/transport.h"
#include "python/engine.h"
#include "python/ops.h"

namespace restage::python {
namespace {

using O = py::object;

/// An op on tensors alone, which has no gradient.
template <class Work>
Tensor without_tape(const Work& work) {
  const py::gil_scoped_release released;
  return work();
}

void add_norms(py::module_& m) {
  m.def(
      "batch_norm",
      [](const O& x, const O& scale, const O& shift, double eps) {
        check_not_negative("batch_norm", "eps", eps);
        return op_of(
            [eps](const Var& xv, const Var& a, const Var& b) { return batch_norm(xv, a, b, eps); },
            x, scale, shift);
      },
      py::arg("x"), py::arg("scale"), py::arg("shift"), py::arg("eps") = 1e-5,
      "x [..., c] normalised over all rows, times scale [c], plus shift [c].");
  m.def(
      "layer_norm",
      [](const O& x, const O& scale, const O& shift, double eps) {
        check_not_negative("layer_norm", "eps", eps);
        return op_of(
            [eps](const Var& xv, const Var& a, const Var& b) { return layer_norm(xv, a, b, eps); },
            x, scale, shift);
      },
      py::arg("x"), py::arg("scale"), py::arg("shift"), py::arg("eps") = 1e-5,
      "Each row of x [..., c] normalised, times scale [c], plus shift [c].");
  m.def(
      "instance_norm",
      [](const O& x, double eps) {
        check_not_negative("instance_norm", "eps", eps);
        return op_of([eps](const Var& v) { return instance_norm(v, eps); }, x);
      },
      py::arg("x"), py::arg("eps") = 1e-5,
      "x [n, v, c], each channel of each item normalised over v.");
  m.def(
      "pooled_norm",
      [](const O& x, const O& w, const O& b, const O& scale, const O& shift,
         const std::string& activation, double eps) {
        const Activation act = activation_of(activation);
        return op_of([&](const Var& xv, const Var& wv, const Var& bv, const Var& s,
                         const Var& t) { return pooled_norm(xv, wv, bv, s, t, act, eps); },
                     x, w, b, scale, shift);
      },
      py::arg("x"), py::arg("weight"), py::arg("bias"), py::arg("scale"), py::arg("shift"),
      py::arg("activation") = "none", py::arg("eps") = 1e-5,
      "The largest over v of activation(batch_norm(x W^T + b)): x [n, v, i], W [o, i] -> [n, o].");
  m.def(
      "modulate",
      [](const O& x, const O& mesh, const O& scale, const O& scale_bias, const O& shift,
         const O& shift_bias, const std::string& activation) {
        const Activation act = activation_of(activation);
        return op_of([&](const Var& xv, const Var& mv, const Var& a, const Var& ab, const Var& b,
                         const Var& bb) { return modulate(xv, mv, a, ab, b, bb, act); },
                     x, mesh, scale, scale_bias, shift, shift_bias);
      },
      py::arg("x"), py::arg("mesh"), py::arg("scale"), py::arg("scale_bias"), py::arg("shift"),
      py::arg("shift_bias"), py::arg("activation") = "none",
      "activation((A m + a) x + (B m + b)) at each point: x [n, v or 1, c], mesh m [n, v, 3], A "
      "and "
      "B [c, 3], a and b [c].");
}

PyVar elain_of(const std::array<O, 5>& given, double slope) {
  const auto v = vars_of(given);
  return run_op(pointers(v),
                [&] { return elain(v[0].var, v[1].var, v[2].var, v[3].var, v[4].var, slope); });
}

PyVar neighbours(const std::array<O, 9>& given, const O& index, double scale, bool dense) {
  const auto v = vars_of(given);
  const Tensor at = index_of(index);
  return run_op(pointers(v), [&] {
    return neighbour_attention(
        {v[0].var, v[1].var, v[2].var, v[3].var, v[4].var, v[5].var, v[6].var, v[7].var, v[8].var},
        at, scale, dense);
  });
}

void add_attention(py::module_& m) {
  m.def(
      "elain",
      [](const O& x, const O& unit, const O& gamma, const O& beta, const O& share, double slope) {
        return elain_of({x, unit, gamma, beta, share}, slope);
      },
      py::arg("x"), py::arg("unit"), py::arg("gamma"), py::arg("beta"), py::arg("share"),
      py::arg("slope") = 1.0,
      "share (gamma unit + beta) + unit + (1 - share) x, times slope where that is 0 or less: all "
      "[n, v, c], share [n, c].");
  m.def(
      "sinkhorn",
      [](const O& kernel, int steps, double epsilon) {
        return op_of([=](const Var& k) { return sinkhorn(k, steps, epsilon); }, kernel);
      },
      py::arg("kernel"), py::arg("steps") = 5, py::arg("epsilon") = 1e-8,
      "The plan of optimal transport between uniform margins by Sinkhorn's steps: positive numbers "
      "[n, v, p] -> [n, v, p].");
  m.def(
      "cross_attention",
      [](const O& q, const O& k, const O& v, double factor) {
        return op_of([factor](const Var& qv, const Var& kv,
                              const Var& vv) { return cross_attention(qv, kv, vv, factor); },
                     q, k, v);
      },
      py::arg("q"), py::arg("k"), py::arg("v"), py::arg("factor") = 1.0,
      "softmax(factor q k^T) v: q [n, t, d], k [n, m, d], v [n, m, c] -> [n, t, c]; memory grows "
      "with t + m.");
  m.def(
      "attention_pool",
      [](const O& score, const O& value, double scale) {
        return op_of([scale](const Var& s, const Var& v) { return attention_pool(s, v, scale); },
                     score, value);
      },
      py::arg("score"), py::arg("value"), py::arg("scale") = 1.0,
      "Sum over k of softmax_k(scale score) value: both [p, k, d] -> [p, d].");
  m.def(
      "neighbour_attention",
      [](const O& xyz, const O& q, const O& k, const O& v, const O& w, const O& b, const O& mm,
         const O& g, const O& gb, const O& index, double scale, bool dense) {
        return neighbours({xyz, q, k, v, w, b, mm, g, gb}, index, scale, dense);
      },
      py::arg("xyz"), py::arg("query"), py::arg("key"), py::arg("value"), py::arg("W"),
      py::arg("b"), py::arg("M"), py::arg("G"), py::arg("g"), py::arg("index"),
      py::arg("scale") = 1.0, py::arg("dense") = false,
      "The point transformer's vector attention (autograd/ops/attention.h): xyz [n, v, 3], query, "
      "key, value [n, v, d], W [d, 3], b [d], M [2d, d], G [d, d], g [d], index of neighbours "
      "[n, v, k].");
  m.def(
      "knn",
      [](const O& query, const O& points, int64_t k) {
        const Tensor q = tensor_of(query), p = tensor_of(points);
        return without_tape([&] { return knn(q, p, k); });
      },
      py::arg("query"), py::arg("points"), py::arg("k"),
      "int32 [n, m, min(k, v)]: the nearest of points [n, v, 3] to each of query [n, m, 3].");
  m.def(
      "fps",
      [](const O& points, int64_t count) {
        const Tensor p = tensor_of(points);
        return without_tape([&] { return fps(p, count); });
      },
      py::arg("points"), py::arg("m"), "int32 [n, m]: m points far from each other, of [n, v, 3].");
}

void add_recurrent(py::module_& m) {
  m.def(
      "gru",
      [](const O& x, const O& h0, const O& wi, const O& wh, const O& bi, const O& bh) {
        return op_of([](const Var& xv, const Var& h, const Var& wiv, const Var& whv, const Var& biv,
                        const Var& bhv) { return gru(xv, h, wiv, whv, biv, bhv); },
                     x, h0, wi, wh, bi, bh);
      },
      py::arg("x"), py::arg("h0"), py::arg("w_ih"), py::arg("w_hh"), py::arg("b_ih"),
      py::arg("b_hh"),
      "One GRU layer, time first: x [t, n, i], h0 [n, h], w_ih [3h, i], w_hh [3h, h], biases [3h] "
      "-> [t, n, h].");
  m.def(
      "recurrence",
      [](const O& a, const O& b, const O& first) {
        return op_of(
            [](const Var& av, const Var& bv, const Var& f) { return recurrence(av, bv, f); }, a, b,
            first);
      },
      py::arg("a"), py::arg("b"), py::arg("first"),
      "y_t = a_t y_(t-1) + b_t: a, b [n, t, m], first [n, m].");
}

}  // namespace

void add_network_ops(py::module_& ops) {
  add_norms(ops);
  add_attention(ops);
  add_recurrent(ops);
}

}  // namespace restage::python
