// The surface of one target in any pose, by the deformation models of a bundle (spec 5). Work that
// depends on the target alone is done once, in the constructor.
#pragma once

#include <optional>

#include "infer/deformer.h"
#include "nn/geometry/body.h"
#include "nn/weights/bundle.h"

namespace restage {

class Surface {
 public:
  /// `models` must hold `deformation.weights`. If they hold `deformation.offsets` too, points are
  /// moved by that network before they are skinned. `where`: the file of `models`, for errors.
  /// `rest`: the target's joints in T-pose. The networks are copied; frames are computed on
  /// `device`.
  Surface(const Bundle& models, const std::string& where, const Mesh& target, const Joints& rest,
          Device device = {});

  /// The posed vertices in the world, metres, in the target's order. `posed` must be
  /// forward_kinematics(rest, pose). `dense`: see Deformer. After a few frames, a call takes no new
  /// memory.
  void operator()(const Pose& pose, const PosedSkeleton& posed, Points* out,
                  bool dense = false) const;
  Points operator()(const Pose& pose, bool dense = false) const;
  const SkinWeights& weights() const { return weights_; }  ///< of the target's vertices

 private:
  Joints rest_;
  SkinWeights weights_;
  bool keep_root_rotation_ = true;
  std::optional<Deformer> deformer_;
};

}  // namespace restage
