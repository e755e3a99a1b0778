// A person's own mesh in T-pose from some clouds: a body of a shape space is fitted to all of them
// together, and what no naked body explains becomes offsets along its normals: clothes and hair.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "infer/track/scan.h"
#include "nn/geometry/shape_space.h"

namespace restage {

/// A cloud that shows the person well, with what the networks say of it.
struct TemplateView {
  Points cloud;        ///< metres
  std::string source;  ///< what errors call it
  Pose pose;           ///< of a person of the space, any one; the turns count
  Joints seen;         ///< the person's joints
};

/// In rounds, the pose in every view and the shape of all views take turns; then the pose and the
/// offsets. Offsets are smooth over the surface. A vertex that no view shows gets what its
/// neighbours have, and hands keep the space's shape. The mesh has the space's faces, so it is as
/// closed as they are. The same input gives the same bits. `say` is told of each round. InputError
/// naming `where`: no views. UnusableCloud: see make_scan().
Body fit_template(const ShapeSpace& space, const std::vector<TemplateView>& views,
                  const std::string& where, const std::function<void(const std::string&)>& say);

}  // namespace restage
