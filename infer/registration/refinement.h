// Our chain's answer fitted to the cloud: the target, in the pose that the networks give and in the
// source's size, is registered to what the source's cloud shows, and performs what that took. As a
// measure of what the networks leave on the table (docs/benchmark.md); a tenth of a second a frame
// and more.
#pragma once

#include <memory>

#include "infer/registration/articulated.h"
#include "infer/retargeter.h"

namespace restage {

class Refinement final : public System {
 public:
  /// InputError naming `where`, the target: see make_rig(). InputError: a chain for a source that
  /// has not 30 fps, or that looks ahead (clouds and answers would not be of the same moment).
  Refinement(std::unique_ptr<Retargeter> chain, const std::string& where);

  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override;
  void miss() override { chain_->miss(); }
  std::span<const RetargetedFrame> finish() override { return chain_->finish(); }
  void restart() override { chain_->restart(); }
  /// The registered target's joints in the last cloud, in the source's build.
  const Joints* source_joints() const override { return &source_joints_; }
  const Mesh& target() const override { return chain_->target(); }
  const SystemRig* rig() const override { return chain_->rig(); }
  Points posed(const Pose& pose) const override { return chain_->posed(pose); }
  const Joints* target_joints() const override { return chain_->target_joints(); }

 private:
  std::unique_ptr<Retargeter> chain_;
  Rig rig_;
  Joints source_joints_;
  std::vector<RetargetedFrame> frames_;  // of the last push
};

}  // namespace restage
