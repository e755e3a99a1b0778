#include "nn/layers/vector_attention.h"

#include <cmath>

#include "autograd/ops/attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

/// From so many pairs of points in a cloud on, folding the weights costs less than it saves.
constexpr int64_t kFoldedPairs = 4096;

}  // namespace

Var neighbour_offsets(const Var& points, const Var& centres, const Tensor& index) {
  return gather(points, index) - reshape(centres, {centres.size(0), centres.size(1), 1, 3});
}

VectorAttention::VectorAttention(int64_t c, int64_t d, int64_t k, const Init& init)
    : fc1(c, d, init.sub("fc1")),
      fc2(d, c, init.sub("fc2")),
      fc_delta({3, d, d}, init.sub("fc_delta")),
      fc_gamma({d, d, d}, init.sub("fc_gamma")),
      w_qs(d, d, init.sub("w_qs"), false),
      w_ks(d, d, init.sub("w_ks"), false),
      w_vs(d, d, init.sub("w_vs"), false),
      d_(d),
      k_(k) {}

Var VectorAttention::operator()(Context& ctx, const Var& xyz, const Var& f) const {
  const ModuleScope path(scope);
  const int64_t n = xyz.size(0), v = xyz.size(1);
  const Tensor index = knn(xyz.value, xyz.value, k_);
  const bool many = v * index.size(2) >= kFoldedPairs;
  return f + fc2(ctx, reshape(many ? folded(ctx, xyz, f, index) : plain(ctx, xyz, f, index),
                              {n, v, d_}));
}

Var VectorAttention::plain(Context& ctx, const Var& xyz, const Var& f, const Tensor& index) const {
  const int64_t n = xyz.size(0), v = xyz.size(1), k = index.size(2);
  const Var h = fc1(ctx, f);
  // x_i - x_j is the negative of the neighbour's offset.
  const Var delta = fc_delta(ctx, neg(neighbour_offsets(xyz, xyz, index)));
  const Var q = reshape(w_qs(ctx, h), {n, v, 1, d_});
  const Var score = fc_gamma(ctx, q - gather(w_ks(ctx, h), index) + delta);
  const Var value = gather(w_vs(ctx, h), index) + delta;
  return attention_pool(reshape(score, {n * v, k, d_}), reshape(value, {n * v, k, d_}),
                        1.0 / std::sqrt(static_cast<double>(d_)));
}

// With D1, D2 the layers of fc_delta, G1, G2 those of fc_gamma and h = relu(D1 r + d1):
//   G1 (q - k + D2 h + d2) + g1 = [G1 q + G1 d2 + g1] - [G1 k] + (G1 D2) h,
//   v + delta                   = [v + d2] + D2 h,
// and what acts on the points (brackets) is folded with fc1 into one matrix of c columns each.
Var VectorAttention::folded(Context& ctx, const Var& xyz, const Var& f, const Tensor& index) const {
  const auto weight = [&](const Linear& l) { return ctx.bind(l.weight); };
  const auto bias = [&](const Linear& l) { return ctx.bind(l.bias); };
  const auto times = [](const Var& m, const Var& column) {  // a matrix times a vector
    return linear(column, m);
  };
  const Linear &delta1 = fc_delta[0], &delta2 = fc_delta[1], &gamma1 = fc_gamma[0],
               &gamma2 = fc_gamma[1];
  const Var w1 = weight(fc1), b1 = bias(fc1), d2 = weight(delta2), g1 = weight(gamma1);
  const Var query = matmul(g1, matmul(weight(w_qs), w1)),
            key = matmul(g1, matmul(weight(w_ks), w1)), value = matmul(weight(w_vs), w1);
  const Var query_bias = times(g1, times(weight(w_qs), b1) + bias(delta2)) + bias(gamma1);
  const Var key_bias = times(g1, times(weight(w_ks), b1));
  const Var value_bias = times(weight(w_vs), b1) + bias(delta2);
  return neighbour_attention(
      {xyz, linear(f, query, query_bias), linear(f, key, key_bias), linear(f, value, value_bias),
       weight(delta1), bias(delta1), concat({matmul(g1, d2), d2}, 0), weight(gamma2), bias(gamma2)},
      index, 1.0 / std::sqrt(static_cast<double>(d_)), dense);
}

void VectorAttention::visit(Fields& f) {
  f("fc1", fc1);
  f("fc2", fc2);
  f("fc_delta", fc_delta);
  f("fc_gamma", fc_gamma);
  f("w_qs", w_qs);
  f("w_ks", w_ks);
  f("w_vs", w_vs);
}

SetAbstraction::SetAbstraction(int64_t m, int64_t k, int64_t in, int64_t out, const Init& init)
    : m_(m), k_(k) {
  for (int i = 0; i < 2; ++i) {
    mlp_convs.emplace(i == 0 ? in : out, out, init.sub("mlp_convs." + std::to_string(i)), true, 2);
    mlp_bns.emplace(out, init);
  }
}

Var SetAbstraction::operator()(Context& ctx, Var* xyz, const Var& f) {
  const ModuleScope path(scope);
  const Var centres = gather(*xyz, fps(xyz->value, m_));
  const Tensor index = knn(centres.value, xyz->value, k_);
  Var g = concat({neighbour_offsets(*xyz, centres, index), gather(f, index)}, 3);
  for (size_t i = 0; i < mlp_convs.size(); ++i) g = relu(mlp_bns[i](ctx, mlp_convs[i](ctx, g)));
  *xyz = centres;
  return max(g, 2);
}

void SetAbstraction::visit(Fields& f) {
  f("mlp_convs", mlp_convs);
  f("mlp_bns", mlp_bns);
}

}  // namespace restage
