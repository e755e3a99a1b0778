#include "nn/models/second_look.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/geometry/body.h"
#include "nn/layers/vector_attention.h"

namespace restage {
namespace {

constexpr int64_t kNeighbours = 32, kLayers = 2;
// Bring lengths in metres to order one, and outputs of order one to metres.
constexpr double kNear = 10, kFar = 2, kCorrection = 0.05;
constexpr int64_t kPose = 3 + 1 + 1;  // numbers that one joint has for each of the 22

/// The axes of every joint as the columns of matrices [n * 22, 3, 3]; the axes of the cloud if
/// rotations are not known.
Tensor axes(const SkeletonAnswer& first) {
  const int64_t n = first.joints.size(0);
  if (first.turns.value.defined())
    return sixd_to_matrix(Var(first.turns.value)).value.reshape({n * kJoints, 3, 3});
  Tensor out = Tensor::zeros({n * kJoints, 3, 3});
  for (int64_t k = 0; k < n * kJoints; ++k)
    for (int64_t c = 0; c < 3; ++c) out.data<float>()[9 * k + 4 * c] = 1;
  return out.to(first.joints.value.device());
}

/// Per joint: where every joint lies in its axes, the logarithm of its uncertainty, and a mark on
/// the joint itself. [n, 22, 22 * 5], constant.
Tensor pose_around(const SkeletonAnswer& first, const Tensor& axes) {
  const int64_t n = first.joints.size(0);
  Tensor out = Tensor::zeros({n, kJoints, kJoints * kPose});
  const Tensor seen = first.joints.value.cpu(), turned = axes.cpu(),
               doubted = first.uncertainty.value.cpu();
  const float *joints = seen.data<float>(), *axis = turned.data<float>();
  const float* unsure = doubted.defined() ? doubted.data<float>() : nullptr;
  float* to = out.data<float>();
  for (int64_t row = 0; row < n * kJoints; ++row)
    for (int64_t j = 0; j < kJoints; ++j, to += kPose) {
      const int64_t other = row / kJoints * kJoints + j;
      const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> own(axis + 9 * row);
      Eigen::Map<Point>{to} =
          static_cast<float>(kFar) * own.transpose() *
          (Eigen::Map<const Point>(joints + 3 * other) - Eigen::Map<const Point>(joints + 3 * row));
      to[3] = unsure != nullptr ? unsure[other] + 4 : 0;  // about zero: e^-4 is 2 cm
      to[4] = row % kJoints == j ? 1 : 0;
    }
  return out.to(axes.device());
}

}  // namespace

SecondLook::SecondLook(int64_t patch, int64_t width, int64_t heads, const Init& init)
    : point({3, patch, width}, init.sub("point")),
      mix(width, width, init.sub("mix")),
      pose({kJoints * kPose, width, width}, init.sub("pose")),
      norm(width, init),
      correct(width, 9, init.sub("correct")),
      unsure(width, 1, init.sub("unsure")) {
  for (int64_t i = 0; i < kLayers; ++i)
    layers.emplace(width, heads, 2 * width, init.sub("layers." + std::to_string(i)));
  correct.start_small();
  unsure.start_small();
}

SkeletonAnswer SecondLook::operator()(Context& ctx, const Var& cloud,
                                      const SkeletonAnswer& first) const {
  const ModuleScope path(scope);
  const int64_t n = cloud.size(0), rows = n * kJoints;
  const Tensor own = axes(first), &joints = first.joints.value;
  const Tensor index = knn(joints, cloud.value, kNeighbours);
  const int64_t k = index.size(2);
  const Var offsets = reshape(neighbour_offsets(cloud, Var(joints), index), {rows, k, 3});
  const Var near = reshape(scale(matmul(offsets, Var(own)), kNear), {n, kJoints, k, 3});
  Var x = mix(ctx, relu(max(point(ctx, near), 2))) + pose(ctx, pose_around(first, own));
  for (size_t i = 0; i < layers.size(); ++i) x = layers[i](ctx, x);
  x = norm(ctx, x);
  // One row for the place and one for each column of the rotation, in the joint's axes; the
  // transposed axes turn them back.
  const Var all = reshape(matmul(reshape(correct(ctx, x), {rows, 3, 3}), Var(own), false, true),
                          {n, kJoints, 9});
  const Vars correction = split(all, 2, {3, 6});
  SkeletonAnswer out;
  out.joints = Var(joints) + scale(correction[0], kCorrection);
  if (first.turns.value.defined())
    out.turns = matrix_to_sixd(Var(own.reshape({n, kJoints, 3, 3}))) + correction[1];
  // The uncertainty learns apart from the rest, as in the first look.
  if (first.uncertainty.value.defined())
    out.uncertainty =
        Var(first.uncertainty.value) + reshape(unsure(ctx, Var(x.value)), {n, kJoints});
  return out;
}

void SecondLook::visit(Fields& f) {
  f("point", point);
  f("mix", mix);
  f("pose", pose);
  f("layers", layers);
  f("norm", norm);
  f("correct", correct);
  f("unsure", unsure);
}

}  // namespace restage
