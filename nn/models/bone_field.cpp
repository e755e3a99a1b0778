#include "nn/models/bone_field.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

constexpr double kNearest = 8;     // how much the nearest bone is preferred at the start
constexpr double kSmooth = 1e-12;  // epsilon of smooth_length(), square metres

/// How far the body goes on behind a leaf (skull, hand, toes), as a part of the bone that leads to
/// the leaf.
double behind_leaf(int joint) {
  if (joint == kHead) return 1.5;
  return joint == kLeftWrist || joint == kRightWrist ? 0.6 : 0.5;
}

/// bones = matrix * joints.
Tensor bone_matrix(DType type) {
  std::vector<double> m(kJoints * kJoints, 0.0);
  for (int j = 0; j < kJoints; ++j) {
    std::vector<int> children;
    for (int k = j + 1; k < kJoints; ++k)
      if (kParents[k] == j) children.push_back(k);
    for (const int k : children) m[j * kJoints + k] += 1.0 / static_cast<double>(children.size());
    if (!children.empty()) m[j * kJoints + j] -= 1;
    if (children.empty()) {
      m[j * kJoints + j] += behind_leaf(j);
      m[j * kJoints + kParents[j]] -= behind_leaf(j);
    }
  }
  return Tensor::from<double>({kJoints, kJoints}, m).cast(type);
}

}  // namespace

Var bones_of(const Var& rest) {
  const int64_t n = rest.size(0);
  const Var rows = reshape(permute(rest, {0, 2, 1}), {3 * n, kJoints});
  const Var bones = linear(rows, Var(bone_matrix(rest.dtype()).to(rest.value.device())));
  return permute(reshape(bones, {n, 3, kJoints}), {0, 2, 1});
}

Var bone_distances(const Var& points, const Var& joints, const Var& bones) {
  const int64_t n = points.size(0), v = points.size(1);
  const Var way = reshape(joint_differences(points, joints), {n, v, kJoints, 3});
  const Var along = reshape(bones, {n, 1, kJoints, 3});
  const Var length2 = add_scalar(reshape(sum(square(bones), -1), {n, 1, kJoints}), kSmooth);
  const Var share = sum(way * along, -1) / length2;
  // Where the nearest point of the bone is: 0 at its beginning, 1 at its end.
  const Var inside = relu(share) - relu(add_scalar(share, -1));
  return smooth_length(way - reshape(inside, {n, v, kJoints, 1}) * along, kSmooth);
}

BoneField::BoneField(const MlpConfig& c, const Init& init)
    : net(4 * kJoints, kJoints, c, false, init) {}

Var BoneField::weights(Context& ctx, const Var& rest, const Var& points) const {
  const ModuleScope path(scope);
  const int64_t n = points.size(0);
  const Var bones = bones_of(rest);
  const Var size = reshape(mean(smooth_length(bones, kSmooth), 1), {n, 1, 1});
  const Var distances = bone_distances(points, rest, bones) / size;
  const Var x = concat({joint_differences(points, rest) / size, distances}, 2);
  return softmax(net(ctx, x) - scale(distances, kNearest));
}

}  // namespace restage
