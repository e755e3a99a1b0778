#include "infer/own_skin.h"

#include <chrono>

namespace restage {

OwnSkin::OwnSkin(std::unique_ptr<System> system, std::shared_ptr<const OwnRig> rig)
    : system_(std::move(system)),
      rig_(std::move(rig)),
      weights_(rig_->weights()),
      shown_{rig_->rest(), weights_} {}

std::span<const RetargetedFrame> OwnSkin::placed(std::span<const RetargetedFrame> frames) {
  const auto start = std::chrono::steady_clock::now();
  if (frames_.size() < frames.size()) frames_.resize(frames.size());
  for (size_t f = 0; f < frames.size(); ++f) {
    RetargetedFrame& out = frames_[f];
    out.pose = frames[f].pose;
    out.confidence = frames[f].confidence;
    out.filled = frames[f].filled;
    out.joints.emplace();
    rig_->place(out.pose, nullptr, &*out.joints, &out.vertices);
  }
  seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {frames_.data(), frames.size()};
}

Points OwnSkin::posed(const Pose& pose) const {
  Joints joints;
  Points out;
  rig_->place(pose, nullptr, &joints, &out);
  return out;
}

FrameTimes OwnSkin::times() const {
  FrameTimes out = system_->times();
  out.deformation += seconds_;
  return out;
}

}  // namespace restage
