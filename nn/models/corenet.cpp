#include "nn/models/corenet.h"

#include <cmath>
#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/transport.h"
#include "nn/models/npt.h"

namespace restage {
namespace {

constexpr double kLeak = 0.2;

std::string numbered(const char* name, size_t i) { return name + std::to_string(i); }

/// x [n, v, c] over the length of its channels, to which float64's epsilon is added.
Var unit_channels(const Var& x) {
  const Var length = add_scalar(smooth_length(x, 1e-24), std::numeric_limits<double>::epsilon());
  return x / reshape(length, {x.size(0), x.size(1), 1});
}

}  // namespace

PointResBlock::PointResBlock(int64_t channels, const Init& init)
    : conv1(channels, channels, init.sub("conv1"), true, 1),
      conv2(channels, channels, init.sub("conv2"), true, 1),
      slope(Tensor::full({1}, 0.25, init.type)) {}

Var PointResBlock::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  const Var a = ctx.bind(slope);
  const Var h = prelu(instance_norm(conv1(ctx, x)), a);
  return prelu(x + instance_norm(conv2(ctx, h)), a);
}

void PointResBlock::visit(Fields& f) {
  f("conv1", conv1);
  f("conv2", conv2);
  f("act.weight", slope);
}

Correspondence::Correspondence(const CoreNetConfig& c, const Init& init)
    : phi(c.widths[2], c.widths[2], init.sub("phi"), true, 1),
      theta(c.widths[2], c.widths[2], init.sub("theta"), true, 1) {
  int64_t in = 3;
  for (size_t i = 0; i < c.widths.size(); ++i) {
    convs.emplace(in, c.widths[i], init.sub(numbered("convs.", i)), true, 1);
    in = c.widths[i];
  }
  for (int64_t i = 0; i < c.blocks; ++i)
    res.emplace(in, init.sub(numbered("res.", static_cast<size_t>(i))));
}

Var Correspondence::features(Context& ctx, const Var& points) const {
  Var x = points;
  for (size_t i = 0; i < convs.size(); ++i)
    x = instance_norm(convs[i](ctx, i == 0 ? x : leaky_relu(x, kLeak)));
  x = unit_channels(x);
  for (size_t i = 0; i < res.size(); ++i) x = res[i](ctx, x);
  return x;
}

Correspondence::Found Correspondence::operator()(Context& ctx, const Var& pose,
                                                 const Var& identity) const {
  const ModuleScope path(scope);
  Found out;
  out.features = features(ctx, identity);
  const Var q = unit_channels(theta(ctx, out.features));
  const Var k = unit_channels(phi(ctx, features(ctx, pose)));
  out.rows = transport_rows(transport_plan(matmul(q, k, false, true)));
  out.warped = matmul(out.rows, pose);
  return out;
}

void Correspondence::visit(Fields& f) {
  f("convs", convs);
  f("res", res);
  f("phi", phi);
  f("theta", theta);
}

Elain::Elain(int64_t channels, int64_t identity, const Init& init)
    : same(identity, channels, init.sub("same"), true, 1),
      gamma(channels, channels, init.sub("gamma"), true, 1),
      beta(channels, channels, init.sub("beta"), true, 1),
      mix(2 * channels, channels, init.sub("mix"), true, 1) {}

WithMean::WithMean(const Var& values) : x(values), mean(restage::mean(values, 1)) {}

Normalised::Normalised(const Var& values) : WithMean(values) {
  constexpr double kEps = 1e-5;
  const auto points = static_cast<double>(x.size(1));
  if (x.size(1) < 2)
    shape_error("elain", "x[n, v, c], v > 1", std::array{x.value}, "one point has no deviation");
  const double unbiased = (points - 1) / points;
  unit = scale(instance_norm(x, kEps * unbiased), std::sqrt(unbiased));
}

Var Elain::through_same(Context& ctx, const Linear& of, const Var& x) const {
  const int64_t channels = of.bias.value.size(0);
  const Var weight = of.matrix(ctx);
  const Var bias = linear(reshape(ctx.bind(same.bias), {1, channels}), weight, ctx.bind(of.bias));
  return linear(x, matmul(weight, same.matrix(ctx)), reshape(bias, {channels}));
}

Var Elain::operator()(Context& ctx, const Normalised& x, const WithMean& identity) const {
  const ModuleScope path(scope);
  const Var share = mix(ctx, concat({same(ctx, identity.mean), x.mean}, 1));
  return elain(x.x, x.unit, through_same(ctx, gamma, identity.x),
               through_same(ctx, beta, identity.x), share, kLeak);
}

void Elain::visit(Fields& f) {
  f("same", same);
  f("gamma", gamma);
  f("beta", beta);
  f("mix", mix);
}

ElainBlock::ElainBlock(int64_t channels, int64_t identity, const Init& init)
    : n0(channels, identity, init.sub("n0")),
      n1(channels, identity, init.sub("n1")),
      ns(channels, identity, init.sub("ns")),
      c0(channels, channels, init.sub("c0")),
      c1(channels, channels, init.sub("c1")),
      cs(channels, channels, init.sub("cs"), false) {}

Var ElainBlock::operator()(Context& ctx, const Var& x, const WithMean& identity) {
  const ModuleScope path(scope);
  const Normalised own(x);
  const Normalised h(c0(ctx, n0(ctx, own, identity)));
  const Var past = cs(ctx, ns(ctx, own, identity));
  return past + c1(ctx, n1(ctx, h, identity));
}

void ElainBlock::visit(Fields& f) {
  f("n0", n0);
  f("n1", n1);
  f("ns", ns);
  f("c0", c0);
  f("c1", c1);
  f("cs", cs);
}

CoreNet::CoreNet(const CoreNetConfig& c, const Init& given)
    : config(c),
      corr(c, given.begun(c.own_start, Start::xavier).sub("corr")),
      fc(3, c.generator[0], 3, given.begun(c.own_start, Start::xavier).sub("fc")),
      out(c.generator[2], 3, given.begun(c.own_start, Start::xavier).sub("out"), true, 1) {
  const Init init = given.begun(c.own_start, Start::xavier);
  int64_t in = c.generator[0];
  for (size_t i = 0; i < c.generator.size(); ++i) {
    convs.emplace(in, c.generator[i], init.sub(numbered("convs.", i)), true, 1);
    blocks.emplace(c.generator[i], c.widths[2], init.sub(numbered("blocks.", i)));
    in = c.generator[i];
  }
}

Var CoreNet::posed(Context& ctx, const Var& pose, const Var& identity,
                   Correspondence::Found* found) {
  const ModuleScope path(scope);
  const Correspondence::Found matched = corr(ctx, pose, identity);
  Var x = fc.same(ctx, matched.warped, 1);
  const WithMean identity_features(matched.features);
  for (size_t i = 0; i < convs.size(); ++i) x = blocks[i](ctx, convs[i](ctx, x), identity_features);
  if (found != nullptr) *found = matched;
  return points_of(ctx, out, x);
}

Var CoreNet::forward(Context& ctx, const TransferInput& in) {
  const int64_t n = in.pose.size(0), t = in.pose.size(1), v = in.identity.size(1);
  const Var mesh = repeat_items(in.identity, t);
  return reshape(posed(ctx, reshape(in.pose, {n * t, in.pose.size(2), 3}), mesh), {n, t, v, 3});
}

void CoreNet::visit(Fields& f) {
  f("corr", corr);
  f("fc", fc);
  f("convs", convs);
  f("blocks", blocks);
  f("out", out);
}

}  // namespace restage
