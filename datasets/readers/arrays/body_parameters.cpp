#include "datasets/readers/arrays/body_parameters.h"

#include <initializer_list>
#include <string_view>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

/// In lower case, without what some put before all names (smpl_thetas, pred_pose) and behind them
/// for the form of their numbers, which the shape tells (body_pose_rotmat).
std::string plain(const std::string& name) {
  std::string out = lower_case(name);
  for (const std::string_view before : {"pred_", "smpl_", "smplh_", "smplx_"})
    if (out.starts_with(before)) out.erase(0, before.size());
  for (const std::string_view behind : {"_rotmat", "_rotmats", "_rot_mat", "_matrix", "_matrices",
                                        "_mat", "_aa", "_axis_angle", "_axisangle"})
    if (out.ends_with(behind)) out.erase(out.size() - behind.size());
  return out;
}

std::string find(const std::vector<std::string>& all,
                 std::initializer_list<std::string_view> names) {
  for (const std::string_view wanted : names)
    for (const std::string& name : all)
      if (plain(name) == wanted) return name;
  return "";
}

}  // namespace

BodyParameters body_parameters(const std::vector<std::string>& names) {
  BodyParameters out;
  out.poses =
      find(names, {"poses_world", "pose_world", "poses", "pose", "thetas", "theta", "fullpose",
                   "full_pose", "rotmat", "rotmats", "rotation_matrices", "local_rot_mats"});
  out.orient = find(names, {"root_orient", "global_orient", "root_orientation",
                            "global_orientation", "root_pose", "global_rot", "root_rot", "orient"});
  out.body = find(names, {"pose_body", "body_pose"});
  out.trans = find(names, {"trans_world", "trans", "transl", "translation", "root_trans",
                           "root_transl", "root_translation", "global_trans", "global_transl",
                           "th_trans", "root_positions", "cam_trans", "cam_t"});
  out.betas = find(names, {"betas", "beta", "shape", "shapes"});
  for (const std::string& name : names) {
    if (lower_case(name) == "smpl_scaling") out.scaling = name;
    if (lower_case(name) == "scale" || lower_case(name) == "smpl_scale") out.scale = name;
  }
  return out;
}

bool is_body_parameter(const std::string& name) {
  const BodyParameters of = body_parameters(std::vector<std::string>{name});
  return of.moves() || !of.orient.empty() || !of.body.empty() || !of.trans.empty() ||
         !of.betas.empty();
}

BodyParameters body_parameters(const ArraySource& file) { return body_parameters(file.names()); }

void refuse_incomplete(const ArraySource& file, const BodyParameters& names) {
  if (names.moves() || (names.orient.empty() && names.body.empty())) return;
  if (names.body.empty())
    throw InputError(file.path(),
                     cat("has the rotations of the root (", names.orient,
                         ") and not of the other joints (its arrays: ", list_of(file.names()), ")"),
                     "add pose_body [F, 63], or all joints as poses [F, 66] or [F, 156]");
  throw InputError(file.path(),
                   cat("has the rotations of the joints (", names.body,
                       ") and not of the root (its arrays: ", list_of(file.names()), ")"),
                   "add root_orient [F, 3], or all joints as poses [F, 66] or [F, 156]");
}

bool is_amass_layout(const ArraySource& file) { return file.has("poses") && file.has("trans"); }

}  // namespace restage
