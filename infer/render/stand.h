// Where a camera stands, so that it is never inside of what it looks at.
#pragma once

#include <vector>

#include "infer/render/rasteriser.h"

namespace restage {

/// How far the figure lies before `camera.target`, towards the camera, metres: 0 or more. Of a
/// cloud (`surface` is false) stray points do not count.
float before_target(const Camera& camera, const Points& points, bool surface);

/// Puts the camera so that `tall` metres are seen at its target: at the opening angle of all
/// pictures, or, where the figure lies `before` metres before the target, so far away that nothing
/// of it is near the camera, at a smaller angle.
void stand_outside(Camera& camera, float tall, float before);

}  // namespace restage
