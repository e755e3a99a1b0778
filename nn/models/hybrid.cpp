#include "nn/models/hybrid.h"

#include <array>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"

namespace restage {
namespace {

constexpr double kCorrection =
    0.02;  // metres, radians and 6D numbers that an answer of 1 stands for
constexpr double kTwist = 0.3, kLeaf = 0.3, kPath = 0.3;
constexpr std::array<int, 5> kLeaves = {10, 11, 15, 20, 21};

/// The identity's first two columns, for each leaf.
Tensor rest_sixd(DType type) {
  std::vector<double> out;
  for (size_t i = 0; i < kLeaves.size(); ++i) out.insert(out.end(), {1, 0, 0, 0, 1, 0});
  return Tensor::from<double>({std::ssize(out)}, out).cast(type);
}

/// Rotations [n, 22, 3, 3] with those of the leaves [n, 5, 3, 3] in their places.
Var with_leaves(const Var& rotations, const Var& leaves) {
  Var out;
  int done = 0;
  const auto append = [&](const Var& x) { out = out.value.defined() ? concat({out, x}, 1) : x; };
  for (int i = 0; i < static_cast<int>(kLeaves.size()); ++i) {
    if (kLeaves[i] > done) append(slice(rotations, 1, done, kLeaves[i]));
    append(slice(leaves, 1, i, i + 1));
    done = kLeaves[i] + 1;
  }
  if (done < kJoints) append(slice(rotations, 1, done, kJoints));
  return out;
}

}  // namespace

Hybrid::Hybrid(const HybridConfig& c, const Init& init)
    : config(c),
      enc(3 * (kJoints + 1), c.hidden, c.layers, c.dropout, init.sub("enc")),
      dec(c.hidden + 3 * kJoints, c.hidden, c.layers, c.dropout, init.sub("dec")),
      correction(c.hidden, 3 * kJoints, init.sub("correction")),
      twist(c.hidden, kJoints, init.sub("twist")),
      leaves(c.hidden, 6 * std::ssize(kLeaves), init.sub("leaves")),
      path(c.hidden, 3, init.sub("path")) {
  for (Linear* head : {&correction, &twist, &leaves, &path}) head->start_small();
  const auto constant = [&](int64_t n, double v) { return Tensor::full({n}, v, init.type); };
  units.joints = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.rest = {constant(3 * kJoints, 0), constant(3 * kJoints, 1)};
  units.trans = {constant(3, 0), constant(3, 1)};
}

void Hybrid::standardise(const MotionStatistics& s) {
  units.joints = s.joints, units.rest = s.rest, units.trans = s.trans;
}

MotionOutput Hybrid::forward(Context& ctx, const Var& joints, const Var& trans, const Var& rest,
                             MotionState* state) const {
  const ModuleScope scope_of_this(scope);
  const int64_t n = joints.size(0), t = joints.size(1), w = 3 * kJoints;
  const Var a = in_units(reshape(joints, {n, t, w}), units.joints);
  const Var v = in_units(trans, units.trans);
  const Var b = in_units(reshape(rest, {n, 1, w}), units.rest);
  state->resize(2);
  const Var code = enc(ctx, concat({a, v}, 2), &(*state)[0]);
  const Var decoded = dec(ctx, concat({code, expand(b, {n, t, w})}, 2), &(*state)[1]);

  const Var moved = reshape(joints, {n, t, w}) + scale(correction(ctx, decoded), kCorrection);
  const Var posed = reshape(moved, {n * t, kJoints, 3});
  const Var rest_rows = rest_of_each_frame(rest, t);
  const Var turns = reshape(scale(twist(ctx, decoded), kTwist), {n * t, kJoints});
  const Var swung = swing_twist(rest_rows, posed, turns, joint_swings());
  const Var sixd = scale(leaves(ctx, decoded), kLeaf) + Var(rest_sixd(joints.dtype()));
  const Var ends = sixd_to_matrix(reshape(sixd, {n * t, std::ssize(kLeaves), 6}));
  const Var local = with_leaves(swung, ends);

  MotionOutput out;
  out.raw = reshape(matrix_to_sixd(local), {n, t, 6 * kJoints});
  put_pose(local, rest_rows, n, &out);
  const Var longer = reshape(leg_lengths(rest_rows) / leg_lengths(posed), {n, t, 1});
  out.trans = trans * longer + scale(path(ctx, decoded), kPath) * Var(units.trans.deviation);
  return out;
}

void Hybrid::visit(Fields& f) {
  f("enc", enc);
  f("dec", dec);
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
