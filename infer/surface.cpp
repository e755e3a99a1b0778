#include "infer/surface.h"

#include "autograd/kernels/rotation.h"

namespace restage {

Surface::Surface(const Bundle& models, const std::string& where, const Mesh& target,
                 const Joints& rest, Device device)
    : rest_(rest) {
  const auto& skinning = models.need_as<DeformationModel>("deformation.weights", where);
  const auto* offsets = models.find_as<OffsetNet>("deformation.offsets");
  if (offsets != nullptr)
    keep_root_rotation_ = models.need("deformation.offsets", where)
                              .setting("keep_root_rotation", {"true", "false"}) == "true";
  const auto v = static_cast<int64_t>(target.vertices.size());
  Tensor points = Tensor::empty({1, v, 3}), joints = Tensor::empty({1, kJoints, 3});
  for (size_t i = 0; i < target.vertices.size(); ++i)
    for (int c = 0; c < 3; ++c)
      points.data<float>()[3 * i + static_cast<size_t>(c)] =
          target.vertices[i][c] - static_cast<float>(rest[0][c]);
  for (size_t j = 0; j < kJoints; ++j)
    for (int c = 0; c < 3; ++c)
      joints.data<float>()[3 * j + static_cast<size_t>(c)] =
          static_cast<float>(rest[j][c] - rest[0][c]);
  Context ctx;
  const Tensor weights =
      skinning.weights(ctx, Var(joints), Var(points)).value.reshape({v, kJoints});
  weights_ = Eigen::Map<const SkinWeights>(weights.data<float>(), v, kJoints);
  deformer_.emplace(points.reshape({v, 3}), weights, offsets, device);
}

void Surface::operator()(const Pose& pose, const PosedSkeleton& posed, Points* out,
                         bool dense) const {
  Tensor local = Tensor::empty({kJoints, 9}), bones = Tensor::empty({kJoints, 3, 4});
  using Bone = Eigen::Matrix<float, 3, 4, Eigen::RowMajor>;
  for (size_t j = 0; j < kJoints; ++j) {
    matrix_at(local.data<float>() + 9 * j) = pose.local[j].cast<float>();
    Eigen::Map<Bone> bone(bones.data<float>() + 12 * j);
    bone.leftCols<3>() = posed.global[j].cast<float>();
    bone.col(3) = (posed.joints[j] - posed.global[j] * (rest_[j] - rest_[0])).cast<float>();
  }
  Tensor angles = Tensor::empty({kJoints, 3});
  launch(FromMatrixArgs{RotationForm::axis_angle, local, angles});
  if (!keep_root_rotation_) std::fill_n(angles.data<float>(), 3, 0.0f);
  const Tensor points = (*deformer_)(angles.reshape({1, 3 * kJoints}), bones, dense);
  out->resize(static_cast<size_t>(points.size(0)));
  for (size_t i = 0; i < out->size(); ++i)
    (*out)[i] = Eigen::Map<const Point>(points.data<float>() + 3 * i);
}

Points Surface::operator()(const Pose& pose, bool dense) const {
  Points out;
  (*this)(pose, forward_kinematics(rest_, pose), &out, dense);
  return out;
}

}  // namespace restage
