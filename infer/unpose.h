// A target that does not stand in T-pose, put into T-pose by what the networks see of it.
#pragma once

#include <optional>

#include "nn/geometry/part_surfaces.h"
#include "nn/weights/bundle.h"

namespace restage {

struct Unposed {
  Mesh mesh;        ///< in T-pose, facing +z, the lowest point at y = 0, the pelvis over the origin
  Joints rest;      ///< its joints
  JointMoves from;  ///< from the given mesh to this one
  double farthest;  ///< of its limbs from where a T-pose has them, degrees
};

/// The extractor says where the joints are and how they are turned from the T-pose; the turns
/// taken back, along the bones, give the joints in T-pose. The deformation network's weights name
/// the parts of the mesh in T-pose; before that, `average` does, an average person whose legs are 1
/// m long. Each vertex goes where the mean of its joints takes it.
///
/// `mesh`: metres, in any pose and facing. Nothing: it stands in T-pose, within 15 degrees, and is
/// best taken as it is; or the weights give no rotations or no skin. InputError naming `where` and
/// the limb that cannot be made out.
std::optional<Unposed> unpose(const Bundle& weights, const std::string& weights_name,
                              const Mesh& mesh, const std::string& where,
                              const PartSurfaces& average, uint64_t seed);

}  // namespace restage
