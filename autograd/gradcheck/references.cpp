#include "autograd/gradcheck/references.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"

namespace restage::gradcheck {

Var gru_reference(const Var& x, const Var& h0, const Var& w_ih, const Var& w_hh, const Var& b_ih,
                  const Var& b_hh) {
  const int64_t n = x.size(1), h = h0.size(1);
  if (x.size(0) == 0) return slice(reshape(h0, {1, n, h}), 0, 0, 0);
  Var state = h0, out;
  for (int64_t t = 0; t < x.size(0); ++t) {
    const Var gi = linear(reshape(slice(x, 0, t, t + 1), {n, x.size(2)}), w_ih, b_ih);
    const Var gh = linear(state, w_hh, b_hh);
    const Vars i = split(gi, 1, {h, h, h}), s = split(gh, 1, {h, h, h});
    const Var r = sigmoid(i[0] + s[0]), z = sigmoid(i[1] + s[1]);
    const Var candidate = tanh(i[2] + r * s[2]);
    state = candidate + z * (state - candidate);
    const Var row = reshape(state, {1, n, h});
    out = t == 0 ? row : concat({out, row}, 0);
  }
  return out;
}

Var neighbour_attention_reference(std::initializer_list<Var> inputs, const Tensor& index,
                                  double scale) {
  const Var* x = inputs.begin();
  const int64_t n = x[0].size(0), v = x[0].size(1), k = index.size(2), d = x[1].size(2);
  const Var r = reshape(x[0], {n, v, 1, 3}) - gather(x[0], index);
  const Vars both = split(linear(linear(r, x[4], x[5], Activation::relu), x[6]), 3, {d, d});
  const Var u = relu(reshape(x[1], {n, v, 1, d}) - gather(x[2], index) + both[0]);
  const Var value = gather(x[3], index) + both[1];
  const Var pooled = attention_pool(reshape(linear(u, x[7], x[8]), {n * v, k, d}),
                                    reshape(value, {n * v, k, d}), scale);
  return reshape(pooled, {n, v, d});
}

Var attention_pool_reference(const Var& score, const Var& value, double scale_) {
  return sum(softmax(scale(score, scale_), 1) * value, 1);
}

Var pooled_norm_reference(const Var& x, const Var& weight, const Var& bias, const Var& scale,
                          const Var& shift, Activation activation, double eps,
                          BatchStatistics* statistics) {
  const Var y = batch_norm(linear(x, weight, bias), scale, shift, eps, statistics);
  return max(activation == Activation::relu ? relu(y) : y, 1);
}

Var modulate_reference(const Var& x, const Var& mesh, const Var& scale, const Var& scale_bias,
                       const Var& shift, const Var& shift_bias, Activation activation) {
  const Var y = linear(mesh, scale, scale_bias) * x + linear(mesh, shift, shift_bias);
  return activation == Activation::relu ? relu(y) : y;
}

Var sinkhorn_reference(const Var& kernel, int steps, double epsilon) {
  const int64_t n = kernel.size(0), v = kernel.size(1), p = kernel.size(2);
  const Var row(Tensor::full({n, v, 1}, 1.0 / static_cast<double>(v), kernel.dtype()));
  const Var column(Tensor::full({n, p, 1}, 1.0 / static_cast<double>(p), kernel.dtype()));
  Var a = row, b;
  for (int i = 0; i < steps; ++i) {
    b = column / add_scalar(matmul(kernel, a, true), epsilon);
    a = row / add_scalar(matmul(kernel, b), epsilon);
  }
  return a * kernel * reshape(b, {n, 1, p});
}

Var elain_reference(const Var& x, const Var& unit, const Var& gamma, const Var& beta,
                    const Var& share, double slope) {
  const Var s = reshape(share, {share.size(0), 1, share.size(1)});
  return leaky_relu(s * (gamma * unit + beta) + unit + add_scalar(neg(s), 1) * x, slope);
}

Var cross_attention_reference(const Var& q, const Var& k, const Var& v, double factor) {
  const Var product = matmul(q, k, false, true);
  return matmul(softmax(factor == 1 ? product : scale(product, factor)), v);
}

}  // namespace restage::gradcheck
