// A second look at a body whose joints are known about: around each joint the points that are
// nearest, in the joint's own axes, in which an elbow is the same elbow however its arm is held
// (docs/method.md, "A second look").
#pragma once

#include "nn/layers/mlp.h"
#include "nn/layers/self_attention.h"
#include "nn/models/skeleton.h"

namespace restage {

/// Corrects an answer. Whatever it makes of it, the answer counts as a constant: what was believed
/// first has its own loss. Untrained it repeats the answer almost as it is.
struct SecondLook : Module {
  SecondLook(int64_t patch, int64_t width, int64_t heads, const Init& init);
  /// `cloud` [n, v, 3] in metres; `first` as SkeletonOutput, turns and uncertainty where it has
  /// them, and then they are answered, too.
  SkeletonAnswer operator()(Context& ctx, const Var& cloud, const SkeletonAnswer& first) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SecondLook"; }
  ReluChain point;  ///< of each near point
  Linear mix;       ///< after the maximum over them
  ReluChain pose;   ///< of where all joints lie, how sure they are, and which joint this is
  ModuleList<EncoderLayer> layers;  ///< over the 22 joints
  LayerNormLayer norm;
  Linear correct;  ///< of each joint: 3 for its place, 2 x 3 for its rotation's columns
  Linear unsure;   ///< and how much surer or less sure it is now, as a logarithm
};

}  // namespace restage
