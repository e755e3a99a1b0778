// A system whose target has bones and a skin of its own (nn/geometry/own_rig.h): the system finds
// the poses, the target's own file says where they put joints and vertices.
#pragma once

#include <memory>
#include <vector>

#include "infer/system.h"
#include "nn/geometry/own_rig.h"

namespace restage {

class OwnSkin final : public System {
 public:
  /// `system` must have been made for rig->mesh() and rig->rest(), and must have a pose in every
  /// frame.
  OwnSkin(std::unique_ptr<System> system, std::shared_ptr<const OwnRig> rig);

  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override {
    return placed(system_->push(cloud, source));
  }
  void miss() override { system_->miss(); }
  std::span<const RetargetedFrame> finish() override { return placed(system_->finish()); }
  void restart() override { system_->restart(); }

  const Mesh& target() const override { return rig_->mesh(); }
  const SystemRig* rig() const override { return &shown_; }
  Points posed(const Pose& pose) const override;
  const Joints* target_joints() const override { return &rig_->rest(); }
  const Joints* source_joints() const override { return system_->source_joints(); }
  FrameTimes times() const override;

 private:
  std::span<const RetargetedFrame> placed(std::span<const RetargetedFrame> frames);

  std::unique_ptr<System> system_;
  std::shared_ptr<const OwnRig> rig_;
  SkinWeights weights_;
  SystemRig shown_;
  std::vector<RetargetedFrame> frames_;  ///< is never made smaller
  double seconds_ = 0;                   ///< that the last call spent here
};

}  // namespace restage
