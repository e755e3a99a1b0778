// A clip is a sequence that is drawn: a row of a contact sheet, or a view of a page.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "infer/render/frame_store.h"
#include "nn/geometry/appearance.h"
#include "nn/geometry/body.h"

namespace restage {

/// Frames of one surface (`faces` are given, every frame has the same number of vertices) or of
/// clouds
/// (`faces` are empty, the number of points may change). World metres, y up. One to three clips are
/// shown together, by convention source, result and truth. Frames with the same number are shown
/// together, so clips that are shown together must have the same rate (at_rate()).
struct Clip {
  std::string label;
  FrameStore<Point> frames;
  std::vector<Triangle> faces;
  std::vector<double> confidence = {};  ///< RetargetedFrame::confidence of each frame; may be empty
  std::vector<Point> focus = {};  ///< the point of each frame that a close-up shows; may be empty
  /// errors[frame][vertex]: distance of the vertex from its true place, metres. A page shows the
  /// distances as colours. Surfaces only; may be empty.
  FrameStore<float> errors = {};
  double fps = kFps;  ///< frames per second
  /// Materials and pictures of the surface; null: it is drawn in one colour.
  std::shared_ptr<const Appearance> look = nullptr;
};

/// The clip at another rate: frame k of the result is the frame of `clip` that is nearest in time
/// to k / fps seconds. The result has at most `frames` frames and ends where `clip` ends.
Clip at_rate(Clip clip, double fps, size_t frames);

/// A cloud that shows a skeleton: some points along each bone.
Points stick_figure(const Joints& joints);

/// The same of any skeleton: along the line from each joint to its parent, which comes before it
/// (-1: none).
Points stick_figure(const Points& joints, const std::vector<int>& parents);

/// InputError naming `where`: there is no clip, there are more than three clips, a clip has no
/// frames, or a clip breaks the rules above. In clouds, points that are not finite are allowed and
/// are not drawn; surfaces must not have such points.
void check_clips(const std::string& where, const std::vector<Clip>& clips);

/// The point that the camera follows: the middle of the points' bounding box, without the outermost
/// two per cent of the points on each side.
Point clip_centre(const Points& points);
/// How far a frame's points count for what the camera has to show, metres: to either side of the
/// centre, and over the floor. Stray points may lie anywhere, but no person is larger than 3.2 m; a
/// giant, most of whose points are, may be.
struct ClipReach {
  float aside = 1.6f, high = 3.2f;
};
ClipReach clip_reach(const Points& points, float floor);
/// The middle of each frame, averaged with the middles of a quarter of a second before and after:
/// the camera follows them calmly.
std::vector<Point> calm_centres(const std::vector<Point>& centres, double fps);
/// The height of the floor under a clip: that of the clip's lowest point, without stray points.
float clip_floor(const Clip& clip);

}  // namespace restage
