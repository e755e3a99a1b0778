// Parameters of a body model (SMPL and its kin): the many names that data sets and
// estimators give them.
#pragma once

#include <string>
#include <vector>

#include "datasets/readers/arrays/array_source.h"

namespace restage {

/// Names of arrays; empty: there is none.
struct BodyParameters {
  std::string poses;    ///< of all joints: poses, pose, smpl_thetas, pred_rotmat ...
  std::string orient;   ///< of the root alone: root_orient, global_orient ...
  std::string body;     ///< of the other joints: pose_body, body_pose ...
  std::string trans;    ///< trans, transl, cam_trans ...
  std::string betas;    ///< betas, smpl_betas, shape ...
  std::string scaling;  ///< smpl_scaling (AIST++): what `trans` has to be divided by
  std::string scale;    ///< scale: what it is of, such files do not agree on
  /// Whether they are a motion, be it without a translation.
  bool moves() const { return !poses.empty() || (!orient.empty() && !body.empty()); }
};

BodyParameters body_parameters(const ArraySource& file);
/// The same of a list of names, such as those of the data sets of an HDF5 file.
BodyParameters body_parameters(const std::vector<std::string>& names);

/// Whether an array of this name would be rotations, a path or a shape.
bool is_body_parameter(const std::string& name);

/// InputError for a file that has rotations of the root and not of the other joints, or the other
/// way round, naming what is missing.
void refuse_incomplete(const ArraySource& file, const BodyParameters& names);

/// Whether it is laid out as AMASS is: `poses` and `trans`.
bool is_amass_layout(const ArraySource& file);

}  // namespace restage
