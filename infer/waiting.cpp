#include "infer/waiting.h"

namespace restage {

const Pose& Waiting::wait(const Pose& rest) {
  if (!shown_) shown_ = rest;
  waits_ = true;
  return *shown_;
}

const Pose& Waiting::go_on(const Pose& said) {
  if (waits_) {
    for (size_t j = 0; j < kJoints; ++j)
      turns_[j] = Quat(Mat3(shown_->local[j] * said.local[j].transpose()));
    shift_ = shown_->root - said.root;
    away_ = kReturnFrames;
    waits_ = false;
  }
  shown_ = said;
  if (away_ == 0) return *shown_;
  const double t = away_ / (kReturnFrames + 1.0), share = t * t * (3 - 2 * t);
  --away_;
  for (size_t j = 0; j < kJoints; ++j)
    shown_->local[j] = Quat::Identity().slerp(share, turns_[j]).toRotationMatrix() * said.local[j];
  shown_->root += share * shift_;
  return *shown_;
}

}  // namespace restage
