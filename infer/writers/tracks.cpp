#include "infer/writers/tracks.h"

namespace restage::glb {

Mat3 in_axes(const RigConvention& rig, size_t j, const Mat3& local) {
  const Mat3 above = j == 0 ? Mat3(Mat3::Identity()) : rig.axes[static_cast<size_t>(kParents[j])];
  return above.transpose() * local * rig.axes[j];
}

bool Tracks::push(const Pose& pose) {
  bool finite = pose.root.allFinite();
  for (const Mat3& r : pose.local) finite = finite && r.allFinite();
  if (!finite) return false;
  const size_t before = turns_.size();
  for (size_t j = 0; j < kJoints; ++j) {
    Eigen::Vector4d c = Quat(in_axes(rig_, j, pose.local[j])).normalized().coeffs();  // x, y, z, w
    // q and -q are the same rotation. LINEAR interpolates the short way only if two quaternions
    // that follow each other have signs that agree.
    double side = c[3];
    if (before > 0) {
      const std::array<float, 4>& last = turns_[before - kJoints + j];
      side = c[0] * last[0] + c[1] * last[1] + c[2] * last[2] + c[3] * last[3];
    }
    if (side < 0) c = -c;
    turns_.push_back({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                      static_cast<float>(c[3])});
  }
  for (int k = 0; k < 3; ++k) roots_.push_back(static_cast<float>(pose.root[k]));
  return true;
}

}  // namespace restage::glb
