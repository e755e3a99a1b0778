// The networks' answer, then fitted to the cloud: the target, in the pose that the networks give
// and in the source's size, is registered to the source's cloud, and performs the rotations that
// the registration found. Shows how much better than the networks' answer a fit would be
// (docs/benchmark.md). A frame takes a tenth of a second or more.
#pragma once

#include "infer/registration/articulated.h"
#include "infer/retargeter.h"

namespace restage {

class Refinement final : public Retargeter {
 public:
  /// `where`: the target's file, for errors. `chain`: what a Retargeter is made from. InputError:
  /// see make_rig(). InputError also if the source's rate is not 30 fps, or if the motion network
  /// looks ahead: an answer would then belong to another moment than the cloud.
  template <class... Chain>
  explicit Refinement(const std::string& where, Chain&&... chain)
      : Retargeter(std::forward<Chain>(chain)...), fitted_rig_(make_rig(target(), rest(), where)) {
    check_frame_by_frame(where);
  }
  /// The joints of the target as registered to the last cloud: in the pose and of the build of the
  /// source.
  const Joints* source_joints() const override { return &source_joints_; }

 private:
  void answer(const Points& cloud, const std::string& source, const Show& show) override;
  /// Frames of a gap have no cloud, and stay as the chain gave them.
  void adjust(RetargetedFrame& frame) override;
  void check_frame_by_frame(const std::string& where) const;

  Rig fitted_rig_;
  std::vector<Vec3> points_;  ///< of the cloud that is answered
  Joints source_joints_;
};

}  // namespace restage
