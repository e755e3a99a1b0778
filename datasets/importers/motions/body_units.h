// Whether the numbers of a body model's motion are metres and radians.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/motions/body_rotations.h"
#include "datasets/importers/motions/motion_clip.h"

namespace restage {

/// Metres that a unit of `trans` is, for each frame: as --scale says (`options`), else by
/// smpl_scaling, which AIST++ divides by, else 1. What is done goes into the report, and so does a
/// `scale` that is not applied. InputError: a smpl_scaling that is none.
std::vector<double> metres_of_trans(const ArraySource& file, const BodyParameters& names,
                                    size_t frames, const MotionOptions& options,
                                    ImportReport& report);

/// InputError for angles that only degrees can be, unless `force`; a remark on those that turn more
/// than once.
void check_radians(const ArraySource& file, const BodyRotations& rotations, bool force,
                   ImportReport& report);

/// The same of a path of the root (`motion` upright, at the rate of the file, in what are taken for
/// metres) that is too fast for anybody or far above or below where the feet are, with the unit
/// that would mend it.
void check_metres(const std::string& where, const SourceMotion& motion,
                  const MotionOptions& options, ImportReport& report);

}  // namespace restage
