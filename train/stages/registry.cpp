#include "train/stages/registry.h"

#include <algorithm>

#include "autograd/base/registry.h"
#include "train/stages/codes_stage.h"
#include "train/stages/deformation_stage.h"
#include "train/stages/motion_stage.h"
#include "train/stages/skeleton_stage.h"
#include "train/stages/transfer_stage.h"

namespace restage {
namespace {

std::deque<StageType> ours() {
  return {
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
}

Registry<StageType>& table() {
  static Registry<StageType> all("stage", ours());
  return all;
}

}  // namespace

const std::deque<StageType>& stage_types() { return table().all(); }

void register_stage(StageType type) { table().add(std::move(type)); }

std::vector<std::string> stage_names() { return table().names(); }

namespace {
std::vector<std::string>& more_figures() {
  static std::vector<std::string> figures;
  return figures;
}
}  // namespace

void set_more_figures(std::vector<std::string> figures) { more_figures() = std::move(figures); }

std::vector<std::string> more_figures_of(const std::string& stage) {
  std::vector<std::string> out;
  for (const std::string& figure : more_figures())
    if (figure.starts_with(stage + ".")) out.push_back(figure.substr(stage.size() + 1));
  return out;
}

std::vector<std::string> known_figures(const StageType& type) {
  std::vector<std::string> out;
  for (const std::string& figure : type.figures) out.push_back(type.name + "." + figure);
  for (const ModelType& model : models())
    if (std::find(type.roles.begin(), type.roles.end(), model.role) != type.roles.end())
      for (const std::string& figure : model.figures) out.push_back(type.name + "." + figure);
  for (const std::string& figure : more_figures_of(type.name))
    out.push_back(type.name + "." + figure);
  return out;
}

std::string unknown_figure(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const StageType& type : stage_types())
    for (std::string& figure : known_figures(type)) known.push_back(std::move(figure));
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end()) return name;
  return "";
}

const StageType& stage_type(const std::string& name) { return table().get(name); }

Bundle networks_of(const StageType& stage, const std::string& path) {
  const Bundle out = load_bundle(path).only(with_late(stage.roles));
  out.need(stage.roles.front(), path);
  return out;
}

}  // namespace restage
