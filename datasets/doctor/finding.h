// What the doctor says: findings in words a newcomer understands, numbers a program can use, and
// the transform that brings the data into our frame (metres, y up, facing +z, floor at y = 0).
#pragma once

#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// p' = scale x rotation x (p - offset); the rotation is proper (nothing is mirrored).
struct Similarity {
  double scale = 1;
  Mat3 rotation = Mat3::Identity();
  Vec3 offset = Vec3::Zero();  ///< in the units and axes of the data
  Vec3 operator()(const Vec3& p) const { return scale * (rotation * (p - offset)); }
  Point operator()(const Point& p) const { return (*this)(Vec3(p.cast<double>())).cast<float>(); }
  /// The way back: p = offset + rotation^T p' / scale.
  Point undo(const Point& p) const {
    return (rotation.transpose() * p.cast<double>() / scale + offset).cast<float>();
  }
  /// First `first`, then this one.
  Similarity after(const Similarity& first) const {
    return {scale * first.scale, rotation * first.rotation,
            first.offset + first.rotation.transpose() * offset / first.scale};
  }
  bool is_identity() const { return scale == 1 && rotation.isIdentity(0) && offset.isZero(0); }
};

enum class Weight {
  fact,   ///< as it should be, or simply so
  note,   ///< worth a look; results may suffer
  wrong,  ///< the result would be nonsense
};
const char* name(Weight weight);  ///< "fact", "note", "wrong"

struct Finding {
  std::string topic;  ///< "units", "up", "facing", "floor", "height", "outliers", ...
  Weight weight = Weight::fact;
  std::string what;
  double sure = 1;       ///< probability that `what` is so; 1 where it was counted
  std::string evidence;  ///< what it was read from
  std::string fix;       ///< what to do about it; empty: nothing
};

}  // namespace restage
