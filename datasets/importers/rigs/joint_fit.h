// Poses of skeletons that have more bones than the 22 joints, or bones that hang otherwise, told by
// turns of the 22. Metres.
#pragma once

#include "datasets/importers/report.h"
#include "nn/geometry/skeleton.h"

namespace restage {

/// Frame by frame: turns joints until those that hang on them lie where the file has them, and
/// measures how far they still are.
///
/// A file's spine may have bones that are none of the 22 joints; an upper arm may be made of two
/// bones, collars may hang on the neck. Such bones turn, too, and the turns of the 22 alone would
/// lose that. So each joint, from the hips outwards, is turned by the smallest rotation that puts
/// the joints on it where they are in the file (orthogonal Procrustes). Spine, neck and collars
/// make up for what is off below them; limbs keep their directions. A turn whose joints lie right
/// is kept bit by bit.
class JointFit {
 public:
  /// `rest`: the joints that the turns start from.
  explicit JointFit(const Joints& rest) : rest_(rest) {}

  /// `pose` as the file has it; changes pose.global, not the points pose.joints.
  void turn(PosedSkeleton& pose);

  /// What is seen in all frames so far: a remark for a joint more than 2 cm from where the file has
  /// it. InputError for hips or a spine that leave the pelvis by more than 25 cm.
  void report(ImportReport& report) const;

 private:
  struct Off {
    double distance = 0;  ///< metres
    int joint = 0;
    size_t frame = 0;
  };
  const Joints rest_;
  Off any_, trunk_;  ///< the worst joint; the worst of hips and spine1
  size_t frames_ = 0;
};

}  // namespace restage
