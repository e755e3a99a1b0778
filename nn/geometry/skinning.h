// Linear blend skinning (spec 5.2) on plain values; the networks' is an op
// (autograd/ops/rotation.h).
#pragma once

#include "nn/geometry/skeleton.h"

namespace restage {

/// One point by its 22 weights: the mean of the places that the joints would take it to from where
/// they rest.
template <class T>
Vec3 blend(const Vec3& point, const T* weights, const Joints& rest, const PosedSkeleton& posed) {
  Vec3 out = Vec3::Zero();
  for (int j = 0; j < kJoints; ++j)
    if (const double w = weights[j]; w != 0)
      out += w * (posed.global[j] * (point - rest[j]) + posed.joints[j]);
  return out;
}

}  // namespace restage
