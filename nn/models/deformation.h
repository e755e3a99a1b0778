// `deformation/*`: skinning weights, pose-corrective offsets and their relatives (spec 5).
#pragma once

#include "nn/config/rules.h"
#include "nn/geometry/skeleton.h"
#include "nn/layers/linear.h"

namespace restage {

struct MlpConfig {
  int64_t width = 256;
  double dropout = 0.2;
  bool small_start = false;
};

template <class V>
void visit(V& v, MlpConfig& c) {
  v("width", c.width, "of the hidden layers", between(1, kMostWidth));
  v("dropout", c.dropout, "dropout rate", below(0, 1));
  v("small_start", c.small_start, "the last layer starts near zero: offsets at none");
}

/// Linear - dropout - ReLU, twice, then Linear and possibly softmax. Names fc1, fc2, fc3.
struct Mlp3 : Module {
  Mlp3(int64_t in, int64_t out, const MlpConfig& config, bool softmax, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  /// The network of join_points(vector, points). What the vector [n, c] of a sample gives to the
  /// first layer is computed once and not for each of the points [n, v, 3].
  Var at_points(Context& ctx, const Var& vector, const Var& points) const;
  /// The network of x with given dropout masks of 0 and 1.
  Var with_masks(Context& ctx, const Var& x, const Tensor& mask1, const Tensor& mask2) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "MLP"; }
  Linear fc1, fc2, fc3;
  double dropout_rate;
  bool with_softmax;

 private:
  /// A hidden layer with ReLU and dropout; `layer` applies the activation that it is given.
  template <class Layer>
  Var hidden(Context& ctx, Layer&& layer) const;
  /// All that follows the first hidden layer.
  Var from_first(Context& ctx, const Var& h1) const;
};

/// How the surface of a target follows its joints; the role `deformation.weights`.
struct DeformationModel : Module {
  /// rest joints [n, 22, 3] and points [n, v, 3], both relative to the rest pelvis, metres ->
  /// skinning weights [n, v, 22], each point's sum 1.
  virtual Var weights(Context& ctx, const Var& rest, const Var& points) const = 0;
};

/// W_net [rest joints (66), p (3)] -> 22 weights.
struct WeightNet final : DeformationModel {
  using Config = MlpConfig;
  WeightNet(const MlpConfig& c, const Init& init) : net(3 * kJoints + 3, kJoints, c, true, init) {}
  Var weights(Context& ctx, const Var& rest, const Var& points) const override;
  void visit(Fields& f) override { net.visit(f); }
  const char* kind() const override { return net.kind(); }
  Mlp3 net;
};

/// The first version's field: [p - J_j (66)] -> 22 weights.
struct V1Field final : DeformationModel {
  using Config = MlpConfig;
  V1Field(const MlpConfig& c, const Init& init) : net(3 * kJoints, kJoints, c, true, init) {}
  Var weights(Context& ctx, const Var& rest, const Var& points) const override;
  void visit(Fields& f) override { net.visit(f); }
  const char* kind() const override { return net.kind(); }
  Mlp3 net;
};

/// O_net [22 axis-angles (66), p (3)] -> offset, metres; the role `deformation.offsets`.
struct OffsetNet final : Mlp3 {
  using Config = MlpConfig;
  OffsetNet(const MlpConfig& c, const Init& init) : Mlp3(3 * kJoints + 3, 3, c, false, init) {}
};

/// The third MLP that the paper's count implies (spec 5.4, H1): rest joints relative to the pelvis
/// (66) -> rest pelvis minus the centroid of the rest points; the role `deformation.root`. Nothing
/// trains or uses it: it is there for the count, and for weights that are imported.
struct RootNet final : Mlp3 {
  using Config = MlpConfig;
  RootNet(const MlpConfig& c, const Init& init) : Mlp3(3 * kJoints, 3, c, false, init) {}
};

/// Points of one batch; shapes [n, v, 3], [n, 22, 3], [n, 22, 3, 3], [n, 66]; all relative to the
/// pelvis.
struct DeformationBatch {
  Tensor rest_points, posed_points, rest_joints, local, axis_angle;
  /// What the networks are shown in the place of rest_points and rest_joints, if it is another.
  Tensor seen_points = {}, seen_joints = {};
};

struct DeformationOutput {
  Var weights, offsets, posed;  ///< [n, v, 22], [n, v, 3] (undefined without offsets), [n, v, 3]
};

/// Eq. 3: posed points from rest points. `offsets` null: none.
DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const DeformationBatch& batch);
/// The same with gradients to what is on a tape.
DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const Var& rest_points, const Var& rest_joints, const Var& local,
                         const Var& axis_angle);

/// Joins a vector per sample [n, c] with every point [n, v, 3]: [n, v, c + 3].
Var join_points(const Var& vector, const Var& points);
/// p - J_j for all joints: points [n, v, 3], joints [n, 22, 3] -> [n, v, 66].
Var joint_differences(const Var& points, const Var& joints);

}  // namespace restage
