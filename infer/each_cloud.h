// What systems have in common that answer each cloud by one frame: how a gap is filled.
#pragma once

#include "infer/system.h"

namespace restage {

/// Answers each cloud of the source by one frame; clouds have to come 30 a second. Frames of a gap
/// are made from the frames of the result on both sides of the gap.
class EachCloud : public System {
 protected:
  /// Shows `now`, the frame of a cloud, and before it the frames of the `missed` clouds before it.
  void show_after_gap(int64_t missed, RetargetedFrame& now, const Show& show);
  /// The last frame again, for every cloud that is missing since.
  void answer_rest(const Show& show) override;
  void forget() override { last_.reset(); }
  /// `frame` is that of the cloud after a gap. Makes it the one that lies `share` of the way from
  /// `before` to that one. Here: rotations turn the shortest way, the pelvis goes straight.
  virtual void mix(const RetargetedFrame& before, double share, RetargetedFrame& frame) const;

 private:
  RetargetedFrame filled_;
  std::optional<RetargetedFrame> last_;  ///< of a cloud
};

/// Joints and vertices of a skinned body in the pose of a frame.
void place_body(const Body& body, RetargetedFrame& frame);

}  // namespace restage
