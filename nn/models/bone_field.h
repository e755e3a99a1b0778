// `deformation/bones`: skinning weights from where a point lies about every bone.
//
// The paper's W_net reads 66 numbers of the skeleton beside the point and has to find out what is
// near; trained on distances alone it settles in a place where head, hands and feet have no skin
// (docs/method.md, "The rig"). This one is told: per joint the way from it and the distance to its
// bone, in units of the person's mean bone, and its logits start as those of the nearest bone.
#pragma once

#include "nn/models/deformation.h"

namespace restage {

/// [p - J_j (66), distance to bone j (22)] / mean bone length -> 22 weights.
struct BoneField final : DeformationModel {
  using Config = MlpConfig;
  BoneField(const MlpConfig& c, const Init& init);
  Var weights(Context& ctx, const Var& rest, const Var& points) const override;
  void visit(Fields& f) override { net.visit(f); }
  const char* kind() const override { return net.kind(); }
  Mlp3 net;
};

/// Vectors from each joint to where its bone ends: to the mean of its children; head, wrists and
/// feet go on by part of the bone that leads to them. [n, 22, 3] -> [n, 22, 3].
Var bones_of(const Var& rest);
/// Distances of points [n, v, 3] to the bones that begin at joints [n, 22, 3]: [n, v, 22], smooth
/// at 0.
Var bone_distances(const Var& points, const Var& joints, const Var& bones);

}  // namespace restage
