// Motions of a body model wherever a pose estimator leaves them in its file: under names of its own
// (smpl_params_global.body_pose, pose_world), in dictionaries of people or of frames, in arrays
// with an axis of people; in NPZ, NPY, pickles, joblib's dumps and files of torch.save
// (nested_file.h).
//
// A motion in the world goes before what a camera saw, both before the vertices beside them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "datasets/importers/motions/amass.h"
#include "datasets/readers/arrays/value_tree.h"

namespace restage {

struct EstimatedMotion {
  std::string person;  ///< who; empty: the only one
  std::string place;   ///< where in the file ("smpl_params_global"); empty: at its top
  std::shared_ptr<const ArraySource> arrays;
  ParameterHints hints;
  bool plain = false;  ///< all of an archive's own arrays, as AMASS has them
};

/// Of each person the motion that goes first; none if there is no motion. InputError: people whose
/// frames do not say who is who, too many values.
std::vector<EstimatedMotion> estimated_motions(const ValueTree& tree,
                                               uint64_t max_memory = kMaxMemory);

/// Whether a file may hold one, by its name and what it begins with: NPZ, NPY of objects, pickles.
bool may_hold_estimates(const std::string& path);
/// Whether an NPZ or an NPY does; true for pickles, which hold nothing else that is read.
bool holds_estimates(const std::string& path, uint64_t max_memory = kMaxMemory);

/// Of a file that may. InputError if it holds none, saying what it holds; of an NPZ then nothing.
std::vector<EstimatedMotion> read_estimated(const std::string& path,
                                            uint64_t max_memory = kMaxMemory);

/// The one of this person; without a name there must be one. InputError naming the people.
EstimatedMotion one_person(std::vector<EstimatedMotion> all, const std::string& person,
                           const std::string& path);

}  // namespace restage
