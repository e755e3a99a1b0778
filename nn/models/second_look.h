// A second look at a body whose joints are roughly known. Around each joint it reads the nearest
// points in the joint's own axes, in which an elbow looks the same however the arm is held
// (docs/method.md, "A second look").
#pragma once

#include "nn/layers/mlp.h"
#include "nn/layers/self_attention.h"
#include "nn/models/skeleton.h"

namespace restage {

/// Corrects an answer. The answer counts as a constant, since the first look has a loss of its own.
/// An untrained second look repeats the answer almost as it is.
struct SecondLook : Module {
  SecondLook(int64_t patch, int64_t width, int64_t heads, const Init& init);
  /// `cloud` [n, v, 3] in metres; `first` as in SkeletonOutput. Turns and uncertainty are answered
  /// if `first` has them.
  SkeletonAnswer operator()(Context& ctx, const Var& cloud, const SkeletonAnswer& first) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SecondLook"; }
  ReluChain point;  ///< layers of each near point
  Linear mix;       ///< applied to the maximum over the near points
  ReluChain pose;   ///< layers of where all joints lie, how sure they are, and which joint this is
  ModuleList<EncoderLayer> layers;  ///< over the 22 joints
  LayerNormLayer norm;
  Linear correct;  ///< of each joint: 3 for its place, 2 x 3 for its rotation's columns
  Linear unsure;   ///< of each joint: by how much its uncertainty changes, as a logarithm
};

}  // namespace restage
