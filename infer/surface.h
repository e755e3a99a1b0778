// The surface of one target in any pose, by the deformation models of a bundle (spec 5). What
// depends on the target alone is computed once.
#pragma once

#include <optional>

#include "infer/deformer.h"
#include "nn/geometry/body.h"
#include "nn/weights/bundle.h"

namespace restage {

class Surface {
 public:
  /// `models` come from `where` (for errors) and need `deformation.weights`; without offsets
  /// skinning is all. `rest`: the target's joints. The networks are copied; frames are computed on
  /// `device`.
  Surface(const Bundle& models, const std::string& where, const Mesh& target, const Joints& rest,
          Device device = {});

  /// Posed vertices, world, in the target's order. `posed`: forward_kinematics(rest, pose).
  /// `dense`: nothing is left out, to compare with. A steady frame takes no memory.
  void operator()(const Pose& pose, const PosedSkeleton& posed, Points* out,
                  bool dense = false) const;
  Points operator()(const Pose& pose, bool dense = false) const;
  const SkinWeights& weights() const { return weights_; }

 private:
  Joints rest_;
  SkinWeights weights_;
  bool keep_root_rotation_ = true;
  std::optional<Deformer> deformer_;
};

}  // namespace restage
