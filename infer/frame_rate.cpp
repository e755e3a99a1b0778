#include "infer/frame_rate.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr double kOn = 1e-6;  // of a frame: what rounding makes of a whole number

Mat3 between(const Mat3& a, const Mat3& b, double share) {
  return Quat(a).slerp(share, Quat(b)).normalized().toRotationMatrix();
}

RetargetedFrame between(const RetargetedFrame& a, const RetargetedFrame& b, double share) {
  RetargetedFrame out;
  for (size_t j = 0; j < kJoints; ++j)
    out.pose.local[j] = between(a.pose.local[j], b.pose.local[j], share);
  out.pose.root = (1 - share) * a.pose.root + share * b.pose.root;
  if (a.fingers && b.fingers) {
    out.fingers.emplace();
    for (size_t k = 0; k < out.fingers->size(); ++k)
      if ((*a.fingers)[k] && (*b.fingers)[k])
        (*out.fingers)[k] = between(*(*a.fingers)[k], *(*b.fingers)[k], share);
  }
  if (a.confidence && b.confidence) out.confidence = std::min(*a.confidence, *b.confidence);
  out.filled = a.filled || b.filled;
  return out;
}

}  // namespace

int64_t FrameRate::count(int64_t frames, double fps) {
  if (frames <= 0) return 0;
  return static_cast<int64_t>(std::floor((static_cast<double>(frames - 1) + kOn) * fps / kFps)) + 1;
}

std::vector<RetargetedFrame> FrameRate::push(const RetargetedFrame& frame) {
  std::vector<RetargetedFrame> out;
  const auto here = static_cast<double>(in_++);
  for (;; ++out_) {
    const double at = static_cast<double>(out_) * kFps / fps_;
    if (at > here + kOn) break;
    out.push_back(at > here - kOn ? frame : between(*before_, frame, at - (here - 1)));
  }
  before_ = frame;
  before_->vertices.clear();
  return out;
}

}  // namespace restage
