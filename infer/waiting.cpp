#include "infer/waiting.h"

namespace restage {

Pose between(const Pose& a, const Pose& b, double t) {
  Pose out;
  for (size_t j = 0; j < kJoints; ++j)
    out.local[j] = Quat(a.local[j]).slerp(t, Quat(b.local[j])).toRotationMatrix();
  out.root = (1 - t) * a.root + t * b.root;
  return out;
}

const Pose& Waiting::wait(const Pose& rest) {
  if (!shown_) shown_ = rest;
  waited_ = *shown_;
  away_ = kReturnFrames;
  return *shown_;
}

const Pose& Waiting::go_on(const Pose& said) {
  if (away_ == 0) return shown_.emplace(said);
  const double t = 1 - away_ / (kReturnFrames + 1.0);
  --away_;
  return shown_.emplace(between(waited_, said, t * t * (3 - 2 * t)));
}

}  // namespace restage
