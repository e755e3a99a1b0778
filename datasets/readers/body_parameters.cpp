#include "datasets/readers/body_parameters.h"

#include <initializer_list>
#include <string_view>

#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

/// In lower case, without what some put before all names: smpl_thetas, pred_pose.
std::string plain(const std::string& name) {
  std::string out = lower_case(name);
  for (const std::string_view before : {"pred_", "smpl_", "smplh_", "smplx_"})
    if (out.starts_with(before)) out.erase(0, before.size());
  return out;
}

std::string find(const Npz& file, std::initializer_list<std::string_view> names) {
  for (const std::string_view wanted : names)
    for (const std::string& name : file.names())
      if (plain(name) == wanted) return name;
  return "";
}

}  // namespace

BodyParameters body_parameters(const Npz& file) {
  BodyParameters out;
  out.poses = find(file, {"poses_world", "pose_world", "poses", "pose", "thetas", "theta",
                          "fullpose", "full_pose"});
  out.orient = find(file, {"root_orient", "global_orient", "root_orientation", "global_orientation",
                           "root_pose", "global_rot", "root_rot", "orient"});
  out.body = find(file, {"pose_body", "body_pose"});
  out.trans =
      find(file, {"trans_world", "trans", "transl", "translation", "root_trans", "root_transl",
                  "root_translation", "global_trans", "global_transl", "th_trans", "cam_trans"});
  out.betas = find(file, {"betas", "beta", "shape", "shapes"});
  return out;
}

bool is_amass_layout(const Npz& file) { return file.has("poses") && file.has("trans"); }

}  // namespace restage
