#include "infer/each_cloud.h"

namespace restage {

void EachCloud::show_after_gap(int64_t missed, RetargetedFrame& now, const Show& show) {
  for (int64_t k = 1; k <= missed; ++k) {
    filled_ = now;
    filled_.filled = true;
    if (last_) mix(*last_, static_cast<double>(k) / static_cast<double>(missed + 1), filled_);
    hand_out(filled_, show);
  }
  hand_out(now, show);
  last_ = now;
}

void EachCloud::answer_rest(const Show& show) {
  for (int64_t k = 0; last_ && k < missed(); ++k) {
    filled_ = *last_;
    filled_.filled = true;
    hand_out(filled_, show);
  }
}

void EachCloud::mix(const RetargetedFrame& before, double share, RetargetedFrame& frame) const {
  frame.pose = between(before.pose, frame.pose, share);
}

void place_body(const Body& body, RetargetedFrame& frame) {
  frame.joints = forward_kinematics(body.joints, frame.pose).joints;
  frame.vertices = linear_blend_skinning(body, frame.pose);
}

}  // namespace restage
