// Rotations, kinematics and skinning on LibTorch's tensors.
#pragma once

#include <torch/torch.h>

namespace bench {

using torch::Tensor;

constexpr int64_t kJoints = 22;

/// The first two columns before orthonormalisation [..., 6] -> [..., 3, 3].
Tensor sixd_to_matrix(const Tensor& v);
/// The first two columns [..., 6].
Tensor matrix_to_sixd(const Tensor& r);
/// [n, 3, 3] -> [n, 3], angle in [0, pi].
Tensor matrix_to_axis_angle(const Tensor& r);

struct Posed {
  Tensor rotations, joints;  ///< [n, 22, 3, 3] global, [n, 22, 3]
};
/// local [n, 22, 3, 3], rest [n, 22, 3], root [n, 3]: all joints of one depth of the tree at once.
Posed forward_kinematics(const Tensor& local, const Tensor& rest, const Tensor& root);
/// points [n, v, 3], weights [n, v, 22] -> [n, v, 3].
Tensor skin(const Tensor& points, const Tensor& weights, const Posed& posed, const Tensor& rest);

}  // namespace bench
