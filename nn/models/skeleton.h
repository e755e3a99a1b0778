// The interface of skeleton extractors: a cloud in, 22 joints out (spec 2.1).
#pragma once

#include <vector>

#include "nn/geometry/skeleton.h"
#include "nn/module.h"

namespace restage {

struct SkeletonAnswer {
  Var joints;  ///< [n, 22, 3], in the frame of the input
  // What a model may say beside them; undefined where it does not.
  Var turns;        ///< [n, 22, 6]: rotation of each joint from the T-pose, two columns, not
                    ///< orthonormal; joints alone do not show twist, the surface does
  Var uncertainty;  ///< [n, 22]: logarithm of the s in p(error) ~ s^-3 exp(-|error| / s), metres
};

/// The answer as constants in the host's memory.
SkeletonAnswer on_host(const SkeletonAnswer& answer);

struct SkeletonOutput : SkeletonAnswer {
  /// The earlier answers of a model that looks again, look by look; each has its own training loss.
  std::vector<SkeletonAnswer> before;
  // What a voting head offers to its training loss; undefined for the other heads.
  Var votes;         ///< [n, c, 22, 3]: where each centre believes each joint to be
  Var segmentation;  ///< [n, c, 22]: logits of the joint that moves each centre
  Tensor centres;    ///< i32 [n, c]: which input points the centres are
};

struct SkeletonInput {
  SkeletonInput(Var points) : cloud(std::move(points)) {}
  SkeletonInput(Tensor points) : cloud(std::move(points)) {}
  SkeletonInput(Tensor points, Tensor remembered)
      : cloud(std::move(points)), past(std::move(remembered)) {}
  Var cloud;    ///< [n, points(), 3], centred on its centroid, metres
  Tensor past;  ///< [n, 22, 4]: joints of the frame before, in the frame of the cloud, metres, and
                ///< the trust in each (trust_of()); undefined where no frame came before
};

/// Nine errors in ten are less than this times s, the uncertainty in SkeletonAnswer.
inline constexpr double kNinety = 5.3223;

/// Trust in a remembered joint: 1 where its uncertainty (SkeletonOutput, metres) is none, 1/2 at
/// 3 cm; 0 stands for a joint that nobody knows.
inline double trust_of(double uncertainty) { return 0.03 / (0.03 + uncertainty); }

struct SkeletonModel : Module {
  /// A cloud on a tape gets a gradient; who is a neighbour of whom counts as constant. A model that
  /// has no use for the past ignores it.
  virtual SkeletonOutput forward(Context& ctx, const SkeletonInput& in) = 0;
  virtual int64_t points() const = 0;
};

/// Bone vectors of rest joints [n, 22, 3]: joint minus parent, [n, 63].
Var bone_vectors(const Var& rest);

}  // namespace restage
