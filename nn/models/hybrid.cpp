#include "nn/models/hybrid.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rnn.h"
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"
#include "nn/models/surface_turns.h"

namespace restage {
namespace {

constexpr double kUsualUncertainty = 0.01;  // metres
// What an answer of 1 stands for: radians, 6D numbers, and deviations of the path.
constexpr double kTwist = 0.3, kLeaf = 0.3, kPath = 0.3;
constexpr double kTrusting = 4;  // log odds of an untrained gate: what is seen counts for 98 %
constexpr int64_t kEnds = std::ssize(kLeaves);

/// y_t = g_t x_t + (1 - g_t) y_(t-1) over [n, t, m]; before the first frame y is x. `last` [n, m]
/// is read and replaced.
Var filtered(const Var& x, const Var& g, Var* last) {
  const int64_t n = x.size(0), t = x.size(1), m = x.size(2);
  if (!last->value.defined()) *last = reshape(slice(x, 1, 0, 1), {n, m});
  const Var y = recurrence(add_scalar(neg(g), 1), g * x, *last);
  *last = reshape(slice(y, 1, t - 1, t), {n, m});
  return y;
}

/// Gates of 22 joints, 22 twists and the leaves [n, t, 22 + 22 + 5] for each of their numbers.
Var for_each_number(const Var& gates) {
  const int64_t n = gates.size(0), t = gates.size(1);
  const auto repeated = [&](int64_t from, int64_t count, int64_t times) {
    const Var one = reshape(slice(gates, 2, from, from + count), {n, t, count, 1});
    return reshape(expand(one, {n, t, count, times}), {n, t, count * times});
  };
  return concat({repeated(0, kJoints, 3), slice(gates, 2, kJoints, 2 * kJoints),
                 repeated(2 * kJoints, kEnds, 6)},
                2);
}

}  // namespace

Hybrid::Hybrid(const HybridConfig& c, const Init& init)
    : config(c),
      enc(3 * (kJoints + 1) + (c.orientation ? 4 * kJoints : 0) + (c.uncertainty ? kJoints : 0),
          c.hidden, c.layers, c.dropout, init.sub("enc")),
      dec(c.hidden + 3 * kJoints, c.hidden, c.layers, c.dropout, init.sub("dec")),
      gate(c.hidden, 2 * kJoints + kEnds, init.sub("gate")),
      correction(c.hidden, 3 * kJoints, init.sub("correction")),
      twist(c.hidden, kJoints, init.sub("twist")),
      leaves(c.hidden, 6 * kEnds, init.sub("leaves")),
      path(c.hidden, 3, init.sub("path")) {
  for (Linear* head : {&gate, &correction, &twist, &leaves, &path}) head->start_small();
  const auto constant = [&](int64_t n, double v) { return Tensor::full({n}, v, init.type); };
  units.joints = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.rest = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.trans = {constant(3, 0), constant(3, 1)};
}

void Hybrid::standardise(const MotionStatistics& s) {
  units.joints = s.joints, units.rest = s.rest, units.trans = s.trans;
}

/// What the encoder sees of A.
Var Hybrid::seen(const MotionInput& in, const SurfaceTurns& surface) const {
  const int64_t n = in.joints.size(0), t = in.joints.size(1);
  Var out = concat({in_units(reshape(in.joints, {n, t, 3 * kJoints}), units.joints),
                    in_units(in.trans, units.trans)},
                   2);
  if (config.orientation)
    out = concat({out, reshape(Var(surface.twist), {n, t, kJoints}),
                  reshape(Var(surface.beyond), {n, t, 3 * kJoints})},
                 2);
  if (!config.uncertainty) return out;
  const Var usual(Tensor::full({n, t, kJoints}, kUsualUncertainty, in.joints.dtype()));
  const Var off = in.uncertainty.defined() ? Var(in.uncertainty) : usual;
  return concat({out, log(off / usual)}, 2);
}

MotionOutput Hybrid::forward(Context& ctx, const MotionInput& in, MotionState* state) const {
  const ModuleScope scope_of_this(scope);
  const int64_t n = in.joints.size(0), t = in.joints.size(1), w = 3 * kJoints;
  const SurfaceTurns surface = surface_turns(in);
  const Var b = in_units(reshape(in.rest, {n, 1, w}), units.rest);
  state->resize(3);
  const Var code = enc(ctx, seen(in, surface), &(*state)[0]);
  const Var decoded = dec(ctx, concat({code, expand(b, {n, t, w})}, 2), &(*state)[1]);

  const Var gates = sigmoid(add_scalar(gate(ctx, decoded), kTrusting));
  const Var ends = reshape(matrix_to_sixd(Var(surface.leaves)), {n, t, 6 * kEnds});
  const Var now = concat(
      {reshape(in.joints, {n, t, w}), reshape(Var(surface.twist), {n, t, kJoints}), ends}, 2);
  const Var calm = filtered(now, for_each_number(gates), &(*state)[2]);
  const Var moved = slice(calm, 2, 0, w) + scale(tanh(correction(ctx, decoded)), config.reach),
            twisted = slice(calm, 2, w, w + kJoints) + scale(twist(ctx, decoded), kTwist),
            sixd = slice(calm, 2, w + kJoints, w + kJoints + 6 * kEnds) +
                   scale(leaves(ctx, decoded), kLeaf);

  const Var posed = reshape(moved, {n * t, kJoints, 3});
  const Var rest_rows = rest_of_each_frame(in.rest, t);
  const Var swung =
      swing_twist(rest_rows, posed, reshape(twisted, {n * t, kJoints}), joint_swings());
  const Var local = with_leaves(swung, sixd_to_matrix(reshape(sixd, {n * t, kEnds, 6})));

  MotionOutput out;
  out.raw = reshape(matrix_to_sixd(local), {n, t, 6 * kJoints});
  put_pose(local, rest_rows, n, &out);
  const Var longer = reshape(leg_lengths(rest_rows) / leg_lengths(posed), {n, t, 1});
  out.trans = in.trans * longer + scale(path(ctx, decoded), kPath) * Var(units.trans.deviation);
  return out;
}

void Hybrid::visit(Fields& f) {
  f("enc", enc);
  f("dec", dec);
  f("gate", gate);
  f("correction", correction);
  f("twist", twist);
  f("leaves", leaves);
  f("path", path);
  f("joint_mean", units.joints.mean);
  f("joint_std", units.joints.deviation);
  f("rest_mean", units.rest.mean);
  f("rest_std", units.rest.deviation);
  f("trans_mean", units.trans.mean);
  f("trans_std", units.trans.deviation);
}

}  // namespace restage
