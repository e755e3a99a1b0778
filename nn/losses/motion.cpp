#include "nn/losses/motion.h"

#include <optional>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/models/skeleton.h"

namespace restage {
namespace {

/// Mean of x over everything but axis 0.
Var per_sample(const Var& x) { return mean(reshape(x, {x.size(0), -1}), 1); }

/// Sum of per-sample values [n] times mask [n], divided by max(sum of mask, 1).
Var masked_mean(const Var& values, const Var& mask) {
  const Tensor ones = mask.value.cast(DType::f64);
  const Var more = relu(add_scalar(sum(Var(ones), 0), -1));
  const Var one(Tensor::full({1}, 1, DType::f64, ones.device()));
  return sum(values * mask, 0) * Var((one / add_scalar(more, 1)).value.cast(values.dtype()));
}

Var differences(const Var& joints) {
  const int64_t t = joints.size(1);
  return slice(joints, 1, 1, t) - slice(joints, 1, 0, t - 1);
}

Var nothing(const MotionBatch& b) {
  return Var(Tensor::zeros({}, b.joints.dtype(), b.joints.value.device()));
}

/// Cross-entropy of which feet stand; 0 if the network does not say it or the batch does not know
/// it.
Var contact_loss(const MotionOutput& out, const MotionBatch& b) {
  if (!out.standing.value.defined() || !b.standing.defined()) return nothing(b);
  return mean_all(softplus(out.standing) - out.standing * Var(b.standing));
}

/// The first version's smoothness: how much the velocity of a path changes.
Var path_loss(const Var& trans) { return mean_all(square(differences(trans))); }

/// The first frames of a batch.
MotionBatch first_frames(MotionBatch b, int64_t frames) {
  for (Var* x : {&b.joints, &b.true_trans, &b.sixd}) *x = slice(*x, 1, 0, frames);
  if (b.standing.defined()) b.standing = slice(Var(b.standing), 1, 0, frames).value;
  return b;
}

/// Cycle, rotation, smoothness and acceleration of a motion that ought to be A's.
void put_reconstruction(const MotionOutput& to_a, const MotionBatch& b, const MotionWeights& w,
                        MotionLosses* out) {
  const auto apart = [&](const Var& x, const Var& y) { return mean_all(errors(x - y, w.measure)); };
  out->cycle = apart(to_a.joints, b.joints) + scale(apart(to_a.trans, b.true_trans), w.translation);
  out->rotation = rotation_loss(to_a.rotations, b.sixd, w.measure);
  const Var moved = differences(to_a.joints), truly = differences(b.joints);
  out->smoothness = apart(moved, truly);
  out->acceleration =
      w.acceleration > 0 ? apart(differences(moved), differences(truly)) : nothing(b);
}

}  // namespace

Var rotation_loss(const Var& rotations, const Var& sixd, Measure measure) {
  return mean_all(errors(reshape(matrix_to_sixd(rotations), sixd.shape()) - sixd, measure, 6));
}

Var twist_loss(const Var& rotations) {
  const int64_t joints = rotations.size(2), frames = rotations.value.numel() / (9 * joints);
  const Var limbs = slice(reshape(rotations, {frames, joints, 9}), 1, 1, joints);
  constexpr double limit = 100.0 / 180.0 * 3.14159265358979323846;
  const Var angle = atan2(neg(slice(limbs, 2, 6, 7)), slice(limbs, 2, 0, 1));
  return mean_all(square(relu(add_scalar(abs(angle), -limit))));
}

MotionLosses motion_losses(Context& ctx, const MotionModel& net, Discriminator* discriminator,
                           const MotionBatch& b, const MotionWeights& w,
                           bool discriminator_gradients) {
  MotionLosses out;
  MotionState forth, back;
  const MotionOutput to_b = net.forward(ctx, b.seen(b.rest_b), &forth);
  const MotionOutput to_a = net.forward(ctx, {to_b.joints, to_b.trans, b.rest_a, {}, {}}, &back);
  out.joints_b = to_b.joints;
  out.trans_b = to_b.trans;
  put_reconstruction(to_a, b, w, &out);
  Var self = per_sample(errors(to_b.joints - b.joints, w.measure)) +
             scale(per_sample(errors(to_b.trans - b.true_trans, w.measure)), w.translation);
  if (w.self_rotation > 0) {
    const Var d = reshape(matrix_to_sixd(to_b.rotations), b.sixd.shape()) - b.sixd;
    self = self + scale(per_sample(errors(d, w.measure, 6)), w.self_rotation);
  }
  out.self = masked_mean(self, Var(b.self_mask));
  out.total = scale(out.cycle, w.cycle) + scale(out.rotation, w.rotation) +
              scale(out.smoothness, w.smoothness) + scale(out.acceleration, w.acceleration) +
              scale(out.self, w.self);
  if (w.contact > 0) out.total = out.total + scale(contact_loss(to_b, b), w.contact);
  if (w.path_smoothness > 0)
    out.total =
        out.total + scale(path_loss(to_b.trans) + path_loss(to_a.trans), 0.5 * w.path_smoothness);
  if (discriminator != nullptr) {
    std::optional<Frozen> judge;
    if (!discriminator_gradients) judge.emplace(ctx);
    const Var logit =
        (*discriminator)(ctx, discriminator_input(to_b.joints, to_b.trans), bone_vectors(b.rest_b));
    out.adversarial = masked_mean(softplus(neg(logit)), add_scalar(neg(Var(b.self_mask)), 1));
    out.total = out.total + scale(out.adversarial, w.adversarial);
  }
  if (w.twist > 0)
    out.total =
        out.total + scale(twist_loss(to_b.rotations) + twist_loss(to_a.rotations), 0.5 * w.twist);
  return out;
}

MotionLosses self_losses(Context& ctx, const MotionModel& net, const MotionBatch& b,
                         const MotionWeights& w) {
  MotionLosses out;
  MotionState state;
  const int64_t t = b.joints.size(1), late = net.latency();
  const MotionOutput to_a = frames_of(net.forward(ctx, b.seen(b.rest_a), &state), late, t);
  const MotionBatch known = first_frames(b, t - late);
  out.joints_b = to_a.joints;
  out.trans_b = to_a.trans;
  put_reconstruction(to_a, known, w, &out);
  out.self = out.cycle + scale(out.rotation, w.rotation) + scale(out.smoothness, w.smoothness) +
             scale(out.acceleration, w.acceleration);
  out.total = scale(out.self, w.self);
  if (w.contact > 0) out.total = out.total + scale(contact_loss(to_a, known), w.contact);
  if (w.path_smoothness > 0)
    out.total = out.total + scale(path_loss(to_a.trans), w.path_smoothness);
  return out;
}

DiscriminatorLosses discriminator_losses(Context& ctx, Discriminator& net, const Var& real,
                                         const Var& real_trans, const Var& real_rest,
                                         const Var& fake, const Var& fake_trans,
                                         const Var& fake_rest) {
  DiscriminatorLosses out;
  const Var on_real = net(ctx, discriminator_input(real, real_trans), bone_vectors(real_rest));
  const Var on_fake = net(ctx, discriminator_input(fake, fake_trans), bone_vectors(fake_rest));
  out.real = bce_with_logits(on_real, 1);
  out.fake = bce_with_logits(on_fake, 0);
  out.total = out.real + out.fake;
  out.fake_score = mean_all(sigmoid(on_fake.detach())).value.cpu().item();
  return out;
}

}  // namespace restage
