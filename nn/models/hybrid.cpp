#include "nn/models/hybrid.h"

#include "nn/geometry/contact.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rnn.h"
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"
#include "nn/models/surface_turns.h"

namespace restage {
namespace {

// Metres; also the uncertainty of joints for which no extractor states one.
constexpr double kUsualUncertainty = 0.005;
constexpr double kPath = 0.3;  // an answer of 1 changes the path by so many deviations
// Rotations reach so many times as far where none are read from the surface.
constexpr double kBlind = 2;
constexpr double kTrusting = 4;  // log odds of an untrained gate: what is seen counts for 98 %
constexpr int64_t kEnds = std::ssize(kLeaves), kGates = 2 * kJoints + kEnds + 1;
// Where the path begins in the numbers that are filtered.
constexpr int64_t kPathAt = 4 * kJoints + 6 * kEnds;
constexpr int64_t kFooting = 16, kFootingHidden = 32;
constexpr double kTrend = -2;  // log odds of an untrained trend's gain: 12 %
constexpr double kBack = -2;   // and of a later frame's

/// What a filter makes of x, and what it had expected of each frame; both [n, t, m].
struct Filtered {
  Var y, expected;
};

/// Holt's filter with gains that change, over x, g, h [n, t, m]:
///   v_t = h_t (x_t - x_(t-1)) + (1 - h_t) v_(t-1),  y_t = g_t x_t + (1 - g_t) (y_(t-1) + v_t);
/// before the first frame y is x and v none. A steady movement is followed without delay. `state`,
/// three tensors [n, m], is read and replaced: x, v and y of the last frame.
Filtered filtered(const Var& x, const Var& g, const Var& h, Var* state) {
  const int64_t n = x.size(0), t = x.size(1), m = x.size(2);
  const auto frame = [&](const Var& of, int64_t i) {
    return reshape(slice(of, 1, i, i + 1), {n, m});
  };
  const auto rest = [](const Var& gain) { return add_scalar(neg(gain), 1); };
  const auto before = [&](const Var& first, const Var& of) {
    const Var one = reshape(first, {n, 1, m});
    return t == 1 ? one : concat({one, slice(of, 1, 0, t - 1)}, 1);
  };
  if (!state[0].value.defined()) {
    state[0] = state[2] = frame(x, 0);
    state[1] = Var(Tensor::zeros({n, m}, x.dtype(), x.value.device()));
  }
  const Var v = recurrence(rest(h), h * (x - before(state[0], x)), state[1]);
  const Var y = recurrence(rest(g), g * x + rest(g) * v, state[2]);
  const Filtered out{y, before(state[2], y) + v};
  state[0] = frame(x, t - 1), state[1] = frame(v, t - 1), state[2] = frame(y, t - 1);
  return out;
}

/// x [n, t, m] after the `frames` frames before it, [n, frames + t, m]; before the first frame x
/// stood still. `state`, the last `frames` frames, is read and replaced.
Var with_earlier(const Var& x, int64_t frames, Var* state) {
  if (frames == 0) return x;
  const int64_t n = x.size(0), t = x.size(1), m = x.size(2);
  if (!state->value.defined()) *state = expand(slice(x, 1, 0, 1), {n, frames, m});
  const Var all = concat({*state, x}, 1);
  *state = slice(all, 1, t, t + frames);
  return all;
}

/// x delayed by `frames` frames.
Var delayed(const Var& x, int64_t frames, Var* state) {
  const int64_t t = x.size(1);
  return slice(with_earlier(x, frames, state), 1, 0, t);
}

/// Frames of `frames` frames ago, which know those since (the smoother of Rauch, Tung and Striebel
/// with learned gains c):  s_t = y_t + c_t (s_(t+1) - p_(t+1)),  p what the filter expected, and s
/// of the newest frame y.
Var smoothed(const Filtered& f, const Var& c, int64_t frames, Var* state) {
  const int64_t m = f.y.size(2);
  const Var all = with_earlier(concat({f.y, f.expected, c}, 2), frames, state);
  const auto part = [&](int64_t which, int64_t from, int64_t to) {
    return slice(slice(all, 2, which * m, (which + 1) * m), 1, from, to);
  };
  Var s = part(0, 0, all.size(1));
  for (int64_t left = all.size(1) - 1; left >= f.y.size(1); --left) {
    const Var surprise = slice(s, 1, 1, left + 1) - part(1, 1, left + 1);
    s = part(0, 0, left) + part(2, 0, left) * surprise;
  }
  return s;
}

/// Repeats the gates of 22 joints, 22 twists, the leaves and the path [n, t, 22 + 22 + 5 + 1] for
/// each number of what they belong to.
Var for_each_number(const Var& gates) {
  const int64_t n = gates.size(0), t = gates.size(1);
  const auto repeated = [&](int64_t from, int64_t count, int64_t times) {
    const Var one = reshape(slice(gates, 2, from, from + count), {n, t, count, 1});
    return reshape(expand(one, {n, t, count, times}), {n, t, count * times});
  };
  return concat({repeated(0, kJoints, 3), slice(gates, 2, kJoints, 2 * kJoints),
                 repeated(2 * kJoints, kEnds, 6), repeated(2 * kJoints + kEnds, 1, 3)},
                2);
}

/// [n, t, 22] -> [n, t, 66]
Var each_thrice(const Var& x) {
  const int64_t n = x.size(0), t = x.size(1);
  return reshape(expand(reshape(x, {n, t, kJoints, 1}), {n, t, kJoints, 3}), {n, t, 3 * kJoints});
}

/// [n, t, 22] -> [n, t, 30]: the number of each leaf, six times.
Var of_leaves(const Var& x) {
  const int64_t n = x.size(0), t = x.size(1);
  const auto one = [&](int64_t j) { return slice(x, 2, j, j + 1); };
  const Var five = concat(
      {one(kLeaves[0]), one(kLeaves[1]), one(kLeaves[2]), one(kLeaves[3]), one(kLeaves[4])}, 2);
  return reshape(expand(reshape(five, {n, t, kEnds, 1}), {n, t, kEnds, 6}), {n, t, 6 * kEnds});
}

/// How ankles and feet move over the ground (m/s, small ones told apart) and lie below the pelvis,
/// per frame: [n, t, 16], constant. `before`: the joints of the frame before [n, 1, 22, 3],
/// replaced. Whether a foot rests is the difference of two large numbers, its velocity about the
/// pelvis and the pelvis' own, which recurrent layers do not find.
Tensor footing_of(const MotionInput& in, Var* before) {
  const int64_t n = in.joints.size(0), t = in.joints.size(1);
  const auto seen = [](const Tensor& x) {
    return x.defined() ? x.cpu().cast(DType::f64) : Tensor();
  };
  const Tensor joints = seen(in.joints.value), trans = seen(in.trans.value),
               last = seen(before->value), turned = seen(in.reframed);
  Tensor out = Tensor::zeros({n, t, kFooting}, DType::f64);
  const auto at = [&](const Tensor& x, int64_t row, int joint) {
    return Eigen::Map<const Vec3>(x.data<double>() + 3 * (row * kJoints + joint));
  };
  for (int64_t i = 0; i < n * t; ++i) {
    double* to = out.data<double>() + i * kFooting;
    Mat3 turn = Mat3::Identity();
    if (turned.defined()) turn = matrix_at(turned.data<double>() + 9 * i);
    for (const int joint : {7, 8, 10, 11}) {
      const Vec3 now = at(joints, i, joint);
      const bool first = i % t == 0;
      const Vec3 then = !first           ? Vec3(at(joints, i - 1, joint))
                        : last.defined() ? Vec3(at(last, i / t, joint))
                                         : now;
      const Vec3 v =
          kFps * (now - turn * then) + Eigen::Map<const Vec3>(trans.data<double>() + 3 * i);
      for (int c = 0; c < 3; ++c) *to++ = std::tanh(2 * v[c]);
      *to++ = now.y() + 0.8;
    }
  }
  *before = Var(slice(in.joints, 1, t - 1, t).value);
  return out.cast(in.joints.dtype()).to(in.joints.value.device());
}

}  // namespace

Hybrid::Hybrid(const HybridConfig& c, const Init& init)
    : config(c),
      enc(3 * (kJoints + 1) + (c.orientation ? 4 * kJoints : 0) + (c.uncertainty ? kJoints : 0),
          c.hidden, c.layers, c.dropout, init.sub("enc")),
      dec(c.hidden + 3 * kJoints, c.hidden, c.layers, c.dropout, init.sub("dec")),
      gate(c.hidden, kGates, init.sub("gate")),
      trend(c.hidden, kGates, init.sub("trend")),
      correction(c.hidden, 3 * kJoints, init.sub("correction")),
      twist(c.hidden, kJoints, init.sub("twist")),
      leaves(c.hidden, 6 * kEnds, init.sub("leaves")),
      path(c.hidden, 3, init.sub("path")) {
  if (c.contact) {
    footing.emplace(kFooting, kFootingHidden, 1, 0.0, init.sub("footing"));
    contact.emplace(kFootingHidden, std::ssize(kFeet), init.sub("contact"));
  }
  if (c.latency > 0 && c.smoothing) back.emplace(c.hidden, kGates, init.sub("back")).start_small();
  for (Linear* head : {&gate, &trend, &correction, &twist, &leaves, &path}) head->start_small();
  const auto constant = [&](int64_t n, double v) { return Tensor::full({n}, v, init.type); };
  units.joints = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.rest = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.trans = {constant(3, 0), constant(3, 1)};
}

void Hybrid::standardise(const MotionStatistics& s) {
  units.joints = s.joints, units.rest = s.rest, units.trans = s.trans;
}

/// What the encoder sees of A.
Var Hybrid::seen(const MotionInput& in, const SurfaceTurns& surface, const Var& uncertainty) const {
  const int64_t n = in.joints.size(0), t = in.joints.size(1);
  Var out = concat({in_units(reshape(in.joints, {n, t, 3 * kJoints}), units.joints),
                    in_units(in.trans, units.trans)},
                   2);
  if (config.orientation)
    out = concat({out, reshape(Var(surface.twist), {n, t, kJoints}),
                  reshape(Var(surface.beyond), {n, t, 3 * kJoints})},
                 2);
  if (!config.uncertainty) return out;
  return concat({out, log(scale(uncertainty, 1 / kUsualUncertainty))}, 2);
}

/// What is seen of each frame, calmed by filters and `latency` frames old; then, as old, its
/// uncertainty.
Var Hybrid::calmed(Context& ctx, const Var& now, const Var& decoded, MotionState* state) const {
  const auto gains = [&](const Linear& head, double start) {
    return for_each_number(sigmoid(add_scalar(head(ctx, decoded), start)));
  };
  constexpr int64_t kSeen = kPathAt + 3;
  const auto seen = [](const Var& x) { return slice(x, 2, 0, kSeen); };
  const auto sure = [](const Var& x) { return slice(x, 2, kSeen, kSeen + kJoints); };
  const Var g = gains(gate, kTrusting), h = gains(trend, kTrend);
  if (!back) {
    const Var then = delayed(now, config.latency, &(*state)[5]);
    return concat({filtered(seen(then), g, h, &(*state)[2]).y, sure(then)}, 2);
  }
  const Filtered f = filtered(seen(now), g, h, &(*state)[2]);
  return concat({smoothed(f, gains(*back, kBack), config.latency, &(*state)[5]),
                 delayed(sure(now), config.latency, &(*state)[8])},
                2);
}

MotionOutput Hybrid::forward(Context& ctx, const MotionInput& in, MotionState* state) const {
  const ModuleScope scope_of_this(scope);
  const int64_t n = in.joints.size(0), t = in.joints.size(1), w = 3 * kJoints;
  const SurfaceTurns surface = surface_turns(in);
  const Var b = in_units(reshape(in.rest, {n, 1, w}), units.rest);
  state->resize(9);
  const Var uncertainty = config.uncertainty && in.uncertainty.defined()
                              ? Var(in.uncertainty)
                              : Var(Tensor::full({n, t, kJoints}, kUsualUncertainty,
                                                 in.joints.dtype(), in.joints.value.device()));
  const Var code = enc(ctx, seen(in, surface, uncertainty), &(*state)[0]);
  const Var decoded = dec(ctx, concat({code, expand(b, {n, t, w})}, 2), &(*state)[1]);

  const Var ends = reshape(matrix_to_sixd(Var(surface.leaves)), {n, t, 6 * kEnds});
  const Var now =
      concat({reshape(in.joints, {n, t, w}), reshape(Var(surface.twist), {n, t, kJoints}), ends,
              in.trans, uncertainty},
             2);
  const Vars calm = split(calmed(ctx, now, decoded, state), 2, {w, kJoints, 6 * kEnds, 3, kJoints});
  const Var believed = calm[4];
  const Var off = scale(believed, 1 / kUsualUncertainty);
  const double turning = config.turn_reach * (config.orientation ? 1 : kBlind);
  const Var moved = calm[0] +
                    scale(tanh(correction(ctx, decoded)), config.reach) * each_thrice(believed),
            twisted = calm[1] + scale(tanh(twist(ctx, decoded)), turning) * off,
            sixd = calm[2] + scale(tanh(leaves(ctx, decoded)), turning) * of_leaves(off);

  const Var posed = reshape(moved, {n * t, kJoints, 3});
  const Var rest_rows = rest_of_each_frame(in.rest, t);
  const Var swung =
      swing_twist(rest_rows, posed, reshape(twisted, {n * t, kJoints}), joint_swings());
  const Var local = with_leaves(swung, sixd_to_matrix(reshape(sixd, {n * t, kEnds, 6})));

  MotionOutput out;
  out.raw = reshape(matrix_to_sixd(local), {n, t, 6 * kJoints});
  put_pose(local, rest_rows, n, &out);
  const Var longer = reshape(leg_lengths(rest_rows) / leg_lengths(posed), {n, t, 1});
  out.trans = calm[3] * longer + scale(path(ctx, decoded), kPath) * Var(units.trans.deviation);
  if (contact)
    out.standing =
        (*contact)(ctx, (*footing)(ctx, Var(footing_of(in, &(*state)[7])), &(*state)[6]));
  return out;
}

void Hybrid::visit(Fields& f) {
  f("enc", enc);
  f("dec", dec);
  f("gate", gate);
  f("trend", trend);
  f("correction", correction);
  f("twist", twist);
  f("leaves", leaves);
  f("path", path);
  if (back) f("back", *back);
  if (footing) f("footing", *footing);
  if (contact) f("contact", *contact);
  f("joint_mean", units.joints.mean);
  f("joint_std", units.joints.deviation);
  f("rest_mean", units.rest.mean);
  f("rest_std", units.rest.deviation);
  f("trans_mean", units.trans.mean);
  f("trans_std", units.trans.deviation);
}

}  // namespace restage
