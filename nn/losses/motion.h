// The losses of motion retargeting (spec 4). All are scalars of shape [1].
#pragma once

#include "nn/losses/measure.h"
#include "nn/models/discriminator.h"
#include "nn/models/motion.h"

namespace restage {

struct MotionWeights {
  double cycle = 1, adversarial = 1, rotation = 0.01, smoothness = 0.1, self = 1;
  double self_rotation = 0;  ///< weight of the rotation loss on the first pass of self samples
  double translation = 1;   ///< weight of the translation relative to the joints, in cycle and self
  double twist = 0;         ///< NKN's twist loss (spec 4.3)
  double acceleration = 0;  ///< of second differences (smoothness: of first differences)
  double contact = 0;       ///< cross-entropy of which feet stand, if the network says it
  /// Mean square of the acceleration of B's path and of A's path after the second pass: the first
  /// version's smoothness, after NKN, whose translation is a velocity (spec 4.4).
  double path_smoothness = 0;
  Measure measure = Measure::mse;
};

/// One batch: motions of A, skeletons of both. Shapes as in MotionModel; self_mask [n] is 1 where B
/// is A. The network sees `input` and `trans`, perhaps with noise; the truth is `joints` and
/// `true_trans`.
struct MotionBatch {
  Var joints, input, true_trans, trans, rest_a, rest_b, sixd;
  Tensor self_mask;
  Tensor turns = {}, uncertainty = {};  ///< of MotionInput
  Tensor standing = {};                 ///< [n, t, 2] 1 where the left or the right foot stands
  Tensor reframed = {};                 ///< of MotionInput
  MotionInput seen(const Var& target_rest) const {
    return {input, trans, target_rest, turns, uncertainty, reframed};
  }
};

struct MotionLosses {
  Var cycle, rotation, smoothness, acceleration, adversarial, self, total;
  Var joints_b, trans_b;  ///< the retargeted motion, for the discriminator's step
};

/// Generator side: A -> B -> A through the same network, whose latency() is 0. If `discriminator`
/// is null the adversarial term is left out. The parameters of the discriminator are constants,
/// unless `discriminator_gradients` asks for their gradients.
MotionLosses motion_losses(Context& ctx, const MotionModel& net, Discriminator* discriminator,
                           const MotionBatch& batch, const MotionWeights& weights,
                           bool discriminator_gradients = false);

/// Self-reconstruction alone: one pass A -> A, whose answer is known; of a network with latency()
/// only the frames that it has answered count. Cycle, rotation and smoothness are the errors of
/// this pass; `self` is their weighted sum.
MotionLosses self_losses(Context& ctx, const MotionModel& net, const MotionBatch& batch,
                         const MotionWeights& weights);

struct DiscriminatorLosses {
  Var real, fake, total;
  double fake_score;  ///< mean sigmoid of the fake logits, for the balance rule
};
/// The losses of the discriminator on constants; real and fake motions go through it in separate
/// passes.
DiscriminatorLosses discriminator_losses(Context& ctx, Discriminator& net, const Var& real,
                                         const Var& real_trans, const Var& real_rest,
                                         const Var& fake, const Var& fake_trans,
                                         const Var& fake_rest);

/// Mean of (6D(predicted) - target)^2 over all numbers, 6D the first two columns of the matrices
/// (Q5), or of the lengths of each joint's six differences. Quaternion networks are compared as
/// matrices too, which needs no choice of sign (Q6).
Var rotation_loss(const Var& rotations, const Var& sixd, Measure measure = Measure::mse);

/// Mean of max(0, |e| - 100 degrees)^2 over joints 1 ... of rotations [n, t, j, 3, 3], with
/// e = atan2(-R20, R00) the angle about y for the order y-z-x (spec 4.3), as NKN.
Var twist_loss(const Var& rotations);

}  // namespace restage
