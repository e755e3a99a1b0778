// What a list of bones that somebody wrote (--bones FILE, VRM's) must fulfil to be a person's.
#pragma once

#include <string>

#include "datasets/importers/rigs/bone_tree.h"

namespace restage {

/// InputError, with both bones, for one bone that is named for two joints, and for limbs that do
/// not hang together: a bone that hangs on another limb, a lower joint above its upper one or in
/// another part of the body. Where bones hang beside each other (all on a root, or on nothing) the
/// rest positions of both sides decide whether left and right are crossed within a limb.
void check_asked(const SourceSkeleton& skeleton, const Bones& bones, const std::string& where,
                 const std::string& mend);

}  // namespace restage
