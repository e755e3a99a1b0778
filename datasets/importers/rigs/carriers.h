// What each node of a rig moves with, where its file hangs it elsewhere than a body does.
#pragma once

#include <vector>

#include "datasets/importers/rigs/gltf_rig.h"

namespace restage {

/// Fills in GltfRig::carrier, strays and order, and says in the report what goes with what.
/// `owner`: per node the joint that turns it, or -1. InputError where bones would have to go with
/// each other.
void find_carriers(const Gltf& file, GltfRig& rig, const std::vector<int>& owner,
                   ImportReport& report);

}  // namespace restage
