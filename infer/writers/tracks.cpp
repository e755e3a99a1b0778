#include "infer/writers/tracks.h"

#include "nn/geometry/rotation_key.h"

namespace restage::glb {

Mat3 in_axes(const RigConvention& rig, size_t j, const Mat3& local) {
  const Mat3 above = j == 0 ? Mat3(Mat3::Identity()) : rig.axes[static_cast<size_t>(kParents[j])];
  return above.transpose() * local * rig.axes[j];
}

bool Tracks::push(const Pose& pose) {
  bool finite = pose.root.allFinite();
  for (const Mat3& r : pose.local) finite = finite && r.allFinite();
  if (!finite) return false;
  for (size_t j = 0; j < kJoints; ++j) {
    const size_t at = turns_.size();
    turns_.push_back(rotation_key(Quat(in_axes(rig_, j, pose.local[j])).normalized(),
                                  at >= kJoints ? &turns_[at - kJoints] : nullptr));
  }
  for (int k = 0; k < 3; ++k) roots_.push_back(static_cast<float>(pose.root[k]));
  return true;
}

}  // namespace restage::glb
