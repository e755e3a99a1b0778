#include "nn/models/smrm.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"

namespace restage {
namespace {

int64_t rotation_width(RotationForm form) { return form == RotationForm::sixd ? 6 : 4; }

}  // namespace

Smrm::Smrm(const SmrmConfig& c, const Init& init)
    : config(c),
      enc(3 * (c.joints + 1), c.hidden, c.layers, c.dropout, init.sub("enc")),
      dec(c.hidden + 3 * c.joints, c.hidden, c.layers, c.dropout, init.sub("dec")),
      fc_rot(c.hidden, c.joints * rotation_width(c.rotation), init.sub("fc_rot")),
      fc_trans(c.hidden, 3, init.sub("fc_trans")) {
  const int64_t width = rotation_width(c.rotation);
  std::vector<double> rest_pose(static_cast<size_t>(c.joints * width), 0.0);
  for (int64_t j = 0; j < c.joints; ++j) {
    rest_pose[j * width] = 1;
    if (width == 6) rest_pose[j * width + 4] = 1;
  }
  if (c.rest_pose_start) {
    fc_rot.start_small();
    if (!c.standardise)
      fc_rot.bias.value = Tensor::from<double>({c.joints * width}, rest_pose).cast(init.type);
  }
  if (c.standardise) {
    const auto constant = [&](int64_t n, double v) { return Tensor::full({n}, v, init.type); };
    joint_mean = constant(3 * c.joints, 0), joint_std = constant(3 * c.joints, 1);
    rest_mean = constant(3 * c.joints, 0), rest_std = constant(3 * c.joints, 1);
    trans_mean = constant(3, 0), trans_std = constant(3, 1);
    rot_mean = Tensor::from<double>({c.joints * width}, rest_pose).cast(init.type);
    rot_std = constant(c.joints * width, 1);
  }
}

void Smrm::standardise(const MotionStatistics& s) {
  if (!config.standardise) return;
  joint_mean = s.joints.mean, joint_std = s.joints.deviation;
  rest_mean = s.rest.mean, rest_std = s.rest.deviation;
  trans_mean = s.trans.mean, trans_std = s.trans.deviation;
  if (config.rotation == RotationForm::sixd) rot_mean = s.sixd.mean, rot_std = s.sixd.deviation;
}

MotionOutput Smrm::forward(Context& ctx, const MotionInput& in, MotionState* state) const {
  const ModuleScope path(scope);
  const int64_t n = in.joints.size(0), t = in.joints.size(1), j = config.joints;
  Var a = reshape(in.joints, {n, t, 3 * j}), v = in.trans, b = reshape(in.rest, {n, 1, 3 * j});
  if (config.standardise) {
    a = in_units(a, {joint_mean, joint_std});
    v = in_units(v, {trans_mean, trans_std});
    b = in_units(b, {rest_mean, rest_std});
  }
  state->resize(2);
  const Var code = enc(ctx, concat({a, v}, 2), &(*state)[0]);
  const Var decoded = dec(ctx, concat({code, expand(b, {n, t, 3 * j})}, 2), &(*state)[1]);
  MotionOutput out;
  out.raw = fc_rot(ctx, decoded);
  out.trans = fc_trans(ctx, decoded);
  if (config.standardise) {
    out.raw = out.raw * Var(rot_std) + Var(rot_mean);
    out.trans = out.trans * Var(trans_std) + Var(trans_mean);
  }
  const Var rows = reshape(out.raw, {n * t, j, rotation_width(config.rotation)});
  const Var local =
      config.rotation == RotationForm::sixd ? sixd_to_matrix(rows) : quaternion_to_matrix(rows);
  put_pose(local, rest_of_each_frame(in.rest, t), n, &out);
  return out;
}

void Smrm::visit(Fields& f) {
  f("enc", enc);
  f("dec", dec);
  f("fc_rot", fc_rot);
  f("fc_trans", fc_trans);
  if (!config.standardise) return;
  f("joint_mean", joint_mean);
  f("joint_std", joint_std);
  f("rest_mean", rest_mean);
  f("rest_std", rest_std);
  f("trans_mean", trans_mean);
  f("trans_std", trans_std);
  f("rot_mean", rot_mean);
  f("rot_std", rot_std);
}

}  // namespace restage
