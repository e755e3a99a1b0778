#include "train/stages/registry.h"

#include "train/stages/codes_stage.h"
#include "train/stages/deformation_stage.h"
#include "train/stages/motion_stage.h"
#include "train/stages/skeleton_stage.h"
#include "train/stages/transfer_stage.h"

namespace restage {
namespace {

std::vector<StageType>& table() {
  static std::vector<StageType> all = {
      stage_of<SkeletonStage>("skeleton", "the skeleton extractor", {"skeleton"},
                              {"joint_error_mm", "tpose_joint_error_mm", "ring_joint_error_mm",
                               "one_camera_joint_error_mm", "intruder_joint_error_mm",
                               "followed_joint_error_mm", "turn_error_degrees", "miscalibration"}),
      stage_of<MotionStage>(
          "motion", "the motion retargeting network", {"motion"},
          {"pa_mpjpe", "local_mpjpe", "cycle_mpjpe", "acceleration", "rotation",
           "closed_form_pa_mpjpe", "closed_form_acceleration", "closed_form_rotation"}),
      stage_of<DeformationStage>("deformation", "skinning weights and offsets",
                                 {"deformation.weights", "deformation.offsets"},
                                 {"with_offsets_mm", "skinning_mm", "skin_lost"}),
      stage_of<TransferStage>("transfer", "a network that poses a mesh without a skeleton",
                              {"transfer"}, {"distance_mm", "pmd_1e4"}),
      stage_of<CodesStage>("codes", "codes of shape, pose and motion of a window of clouds",
                           {"codes"}, {"distance_mm", "shape_mm"}),
  };
  return all;
}

}  // namespace

const std::vector<StageType>& stage_types() { return table(); }

void register_stage(StageType type) {
  for (const StageType& known : table())
    if (known.name == type.name) throw Error("there is a stage '" + type.name + "' already");
  table().push_back(std::move(type));
}

std::vector<std::string> stage_names() {
  std::vector<std::string> out;
  for (const StageType& type : stage_types()) out.push_back(type.name);
  return out;
}

std::string unknown_figure(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    bool known = false;
    for (const StageType& type : stage_types())
      for (const std::string& figure : type.figures) known |= name == type.name + "." + figure;
    if (!known) return name;
  }
  return "";
}

const StageType& stage_type(const std::string& name) {
  for (const StageType& type : stage_types())
    if (type.name == name) return type;
  throw InputError("", "there is no stage '" + name + "'", "use one of those in the configuration");
}

Bundle networks_of(const StageType& stage, const std::string& path) {
  const Bundle out = load_bundle(path).only(with_late(stage.roles));
  out.need(stage.roles.front(), path);
  return out;
}

}  // namespace restage
