// `deformation/*`: skinning weights, pose-corrective offsets and their relatives (spec 5).
#pragma once

#include <memory>

#include "nn/geometry/skeleton.h"
#include "nn/layers/linear.h"

namespace restage {

/// Linear - dropout - ReLU, twice, then Linear and possibly softmax. Names fc1, fc2, fc3.
struct Mlp3 : Module {
  Mlp3(int64_t in, int64_t out, int64_t width, double dropout, bool softmax, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  /// The same for join_points(vector, points): what a sample's vector [n, c] gives the first layer
  /// is computed once and not for each of its points [n, v, 3].
  Var at_points(Context& ctx, const Var& vector, const Var& points) const;
  /// The same with given 0/1 dropout masks.
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

inline constexpr int64_t kMlpWidth = 256;

/// W_net [rest joints (66), p (3)] -> 22 weights; joints and p relative to the rest pelvis.
std::unique_ptr<Mlp3> make_weight_net(const Init& init, int64_t width = kMlpWidth);
/// O_net [22 axis-angles (66), p (3)] -> offset, metres.
std::unique_ptr<Mlp3> make_offset_net(const Init& init, int64_t width = kMlpWidth);
/// The third MLP that the paper's count implies (spec 5.4, H1): rest joints relative to the pelvis
/// (66)
/// -> rest pelvis minus the centroid of the rest points.
std::unique_ptr<Mlp3> make_root_net(const Init& init, int64_t width = kMlpWidth);
/// The first version's field: [p - J_j (66)] -> 22 weights.
std::unique_ptr<Mlp3> make_v1_field(const Init& init, int64_t width = kMlpWidth);

/// Joins a vector per sample [n, c] with every point [n, v, 3]: [n, v, c + 3].
Var join_points(const Var& vector, const Var& points);
/// p - J_j for all joints: points [n, v, 3], joints [n, 22, 3] -> [n, v, 66].
Var joint_differences(const Var& points, const Var& joints);

}  // namespace restage
