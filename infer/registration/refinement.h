// The networks' answer, then fitted to the cloud: the target, in the pose that the networks give
// and in the source's size, is registered to the source's cloud, and performs the rotations that
// the registration found. Shows how much better than the networks' answer a fit would be
// (docs/benchmark.md). A frame takes a tenth of a second or more.
#pragma once

#include <memory>

#include "infer/registration/articulated.h"
#include "infer/retargeter.h"

namespace restage {

class Refinement final : public System {
 public:
  /// `where`: the target's file, for errors. InputError: see make_rig(). InputError also if the
  /// source's rate is not 30 fps, or if the motion network looks ahead: an answer would then belong
  /// to another moment than the cloud.
  Refinement(std::unique_ptr<Retargeter> chain, const std::string& where);

  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override;
  void miss() override { chain_->miss(); }
  std::span<const RetargetedFrame> finish() override { return chain_->finish(); }
  void restart() override { chain_->restart(); }
  /// The joints of the target as registered to the last cloud: in the pose and of the build of the
  /// source.
  const Joints* source_joints() const override { return &source_joints_; }
  const Mesh& target() const override { return chain_->target(); }
  const SystemRig* rig() const override { return chain_->rig(); }
  Points posed(const Pose& pose) const override { return chain_->posed(pose); }
  const Joints* target_joints() const override { return chain_->target_joints(); }

 private:
  std::unique_ptr<Retargeter> chain_;
  Rig rig_;
  Joints source_joints_;
  std::vector<RetargetedFrame> frames_;  // returned by the last push
};

}  // namespace restage
