// What is drawn: one row of a contact sheet, one view of a page.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Frames of one surface (same vertex count in every frame, `faces` given) or of clouds (`faces`
/// empty; counts may change). World metres, y up. Between one and three clips are shown together,
/// by convention source, result, truth; frames of the same number are shown together, so their
/// rates must be the same (at_rate()).
struct Clip {
  std::string label;
  std::vector<Points> frames;
  std::vector<Triangle> faces;
  std::vector<double> confidence = {};  ///< of each frame, 0 to 1; empty if nobody says
  std::vector<Point> focus = {};        ///< of each frame, what a close-up looks at; may be empty
  /// Of each vertex (innermost) of each frame, how far it is off, metres: a page shows them as
  /// colours. Surfaces only; may be empty.
  std::vector<std::vector<float>> errors = {};
  double fps = kFps;  ///< frames per second
};

/// The clip at another rate: of each moment k / fps, up to `frames` of them, its nearest frame. It
/// ends where the clip does.
Clip at_rate(Clip clip, double fps, size_t frames);

/// Enough points along each bone to see it.
Points stick_figure(const Joints& joints);

/// InputError when there is nothing to draw (no clips, more than three, a clip without frames) or a
/// clip breaks the rules above. Points that are not finite are allowed in clouds only and not
/// drawn.
void check_clips(const std::string& where, const std::vector<Clip>& clips);

/// Middle of the points' bounding box, level, that the view follows; y is the middle's height.
Point clip_centre(const Points& points);
/// Height of the floor under a clip: lowest point over all frames, but for stray points.
float clip_floor(const Clip& clip);

}  // namespace restage
