#include "infer/render/clip.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "autograd/base/error.h"

namespace restage {
namespace {

/// The value that would stand at `place` if the values were sorted.
float ranked(std::vector<float>& values, size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Replaces `list`, which has an element for each frame or none at all, by the elements of the
/// chosen frames.
template <class List>
void choose(const std::vector<size_t>& chosen, List* list) {
  if (list->empty()) return;
  List out;
  std::transform(chosen.begin(), chosen.end(), std::back_inserter(out),
                 [&](size_t frame) { return list->at(frame); });
  *list = std::move(out);
}

void check_look(const std::string& where, const Clip& clip) {
  if (!clip.look) return;
  const Appearance& look = *clip.look;
  const size_t count = clip.frames.front().size();
  const auto known = [](const auto& list, size_t size) {
    return std::all_of(list.begin(), list.end(), [&](int32_t number) {
      return number >= 0 && static_cast<size_t>(number) < size;
    });
  };
  const auto fits = [&](size_t size) { return size == 0 || size == count; };
  bool pictures = true;
  for (const Material& material : look.materials)
    for (const int picture : {material.texture.picture, material.glow_texture.picture})
      pictures = pictures && picture < static_cast<int>(look.pictures.size());
  if (look.material.size() != clip.faces.size() || !known(look.material, look.materials.size()) ||
      !known(look.smooth, count) || !fits(look.uv.size()) || !fits(look.colours.size()) ||
      !fits(look.smooth.size()) || !pictures)
    throw InputError(where, "\"" + clip.label + "\" has the looks of another surface",
                     "give looks of its own vertices and faces, or none");
}

}  // namespace

Clip at_rate(Clip clip, double fps, size_t frames) {
  std::vector<size_t> chosen;
  for (size_t k = 0; k < frames; ++k) {
    const auto nearest = static_cast<size_t>(std::llround(static_cast<double>(k) * clip.fps / fps));
    if (nearest >= clip.frames.size()) break;
    chosen.push_back(nearest);
  }
  choose(chosen, &clip.frames);
  choose(chosen, &clip.confidence);
  choose(chosen, &clip.focus);
  choose(chosen, &clip.errors);
  clip.fps = fps;
  return clip;
}

Points stick_figure(const Points& joints, const std::vector<int>& parents) {
  constexpr int kPointsPerBone = 12;
  Points out;
  for (size_t j = 0; j < joints.size(); ++j)
    for (int k = 0; parents[j] >= 0 && k <= kPointsPerBone; ++k) {
      const float t = static_cast<float>(k) / kPointsPerBone;
      out.push_back((1 - t) * joints[static_cast<size_t>(parents[j])] + t * joints[j]);
    }
  return out;
}

Points stick_figure(const Joints& joints) {
  Points points;
  for (const Vec3& joint : joints) points.push_back(joint.cast<float>());
  return stick_figure(points, {kParents.begin(), kParents.end()});
}

void check_clips(const std::string& where, const std::vector<Clip>& clips) {
  if (clips.empty() || clips.size() > 3)
    throw InputError(where, std::to_string(clips.size()) + " sequences to draw",
                     "give one to three");
  for (const Clip& clip : clips) {
    if (clip.frames.empty())
      throw InputError(where, "\"" + clip.label + "\" has no frames", "give at least one");
    if (!clip.confidence.empty() && clip.confidence.size() != clip.frames.size())
      throw InputError(where, "\"" + clip.label + "\" has confidence for other frames than its own",
                       "write one number per frame, or none");
    if (!clip.focus.empty() && clip.focus.size() != clip.frames.size())
      throw InputError(where, "\"" + clip.label + "\" has a focus for other frames than its own",
                       "write one point per frame, or none");
    const size_t count = clip.frames.front().size();
    const bool fits = std::all_of(clip.errors.begin(), clip.errors.end(),
                                  [&](const auto& list) { return list.size() == count; });
    if (!clip.errors.empty() &&
        (clip.faces.empty() || clip.errors.size() != clip.frames.size() || !fits))
      throw InputError(where, "\"" + clip.label + "\" has errors of other vertices than its own",
                       "write one number per vertex and frame of a surface, or none");
    check_look(where, clip);
    for (size_t f = 0; f < clip.frames.size(); ++f) {
      const std::string frame = "frame " + std::to_string(f) + " of \"" + clip.label + "\"";
      const Points& points = clip.frames[f];
      if (points.empty()) throw InputError(where, frame + " is empty", "leave such frames out");
      if (clip.faces.empty()) continue;
      if (points.size() != count)
        throw InputError(where, frame + " has another number of vertices",
                         "give one mesh per clip");
      for (const Point& p : points)
        if (!p.allFinite())
          throw InputError(where, frame + " holds numbers that are not finite",
                           "mend the sequence");
    }
    for (const Triangle& face : clip.faces)
      for (const int32_t v : face)
        if (v < 0 || static_cast<size_t>(v) >= count)
          throw InputError(where,
                           "a face of \"" + clip.label + "\" names vertex " + std::to_string(v) +
                               " of " + std::to_string(count),
                           "mend the faces");
  }
}

Point clip_centre(const Points& points) {
  // Two per cent of the points are left out on each side: stray points of a scan must not move the
  // view.
  Point centre = Point::Zero();
  std::vector<float> values;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Point& p : points)
      if (p.allFinite()) values.push_back(p[axis]);
    if (values.empty()) return centre;
    const size_t stray = values.size() / 50;
    const float low = ranked(values, stray), high = ranked(values, values.size() - 1 - stray);
    centre[axis] = 0.5f * (low + high);
  }
  return centre;
}

ClipReach clip_reach(const Points& points, float floor) {
  constexpr float kRoom = 1.3f, kLargest = 1000;  // metres: beyond, numbers are no figure's
  const Point centre = clip_centre(points);
  std::vector<float> away;
  for (const Point& p : points)
    if (p.allFinite()) away.push_back((p - centre).norm());
  ClipReach out;
  if (away.empty()) return out;
  const float reach = kRoom * ranked(away, (away.size() - 1) * 98 / 100);
  const float high = centre.y() - floor + reach;
  if (!(reach < kLargest && high < kLargest)) return out;
  out.aside = std::max(out.aside, reach);
  out.high = std::max(out.high, high);
  return out;
}

std::vector<Point> calm_centres(const std::vector<Point>& centres, double fps) {
  std::vector<Point> calm;
  const auto reach = static_cast<std::ptrdiff_t>(std::lround(std::min(fps, 240.0) / 4));
  const auto count = static_cast<std::ptrdiff_t>(centres.size());
  for (std::ptrdiff_t f = 0; f < count; ++f) {
    const std::ptrdiff_t side = std::min({reach, f, count - 1 - f});
    Point sum = Point::Zero();
    for (std::ptrdiff_t k = f - side; k <= f + side; ++k) sum += centres[k];
    calm.push_back(sum / static_cast<float>(2 * side + 1));
  }
  return calm;
}

float clip_floor(const Clip& clip) {
  std::vector<float> lowest, heights;
  for (const Points& points : clip.frames) {
    heights.clear();
    for (const Point& p : points)
      if (p.allFinite()) heights.push_back(p.y());
    if (heights.empty()) continue;
    lowest.push_back(ranked(heights, heights.size() / 500));
  }
  if (lowest.empty()) return 0;
  const float low = ranked(lowest, lowest.size() / 50);
  // Where the floor is y = 0, feet seem to stand a little over the floor or in it. So heights near
  // 0 count as 0.
  return low > -0.1f && low < 0.1f ? 0 : low;
}

}  // namespace restage
