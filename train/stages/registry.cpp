#include "train/stages/registry.h"

#include "train/stages/deformation_stage.h"
#include "train/stages/motion_stage.h"
#include "train/stages/skeleton_stage.h"

namespace restage {

std::unique_ptr<Stage> make_stage(const std::string& name, const TrainConfig& c,
                                  const Corpus& train, const Corpus& validation) {
  if (name == "skeleton")
    return std::make_unique<SkeletonStage>(c.skeleton, train, validation, c.seed);
  if (name == "motion") return std::make_unique<MotionStage>(c.motion, train, validation, c.seed);
  if (name == "deformation")
    return std::make_unique<DeformationStage>(c.deformation, train, validation, c.seed);
  throw InputError("", "there is no stage '" + name + "'", "use skeleton, motion or deformation");
}

}  // namespace restage
