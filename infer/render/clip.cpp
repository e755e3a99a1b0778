#include "infer/render/clip.h"

#include <algorithm>
#include <limits>

#include "autograd/base/error.h"

namespace restage {

void check_clips(const std::string& where, const std::vector<Clip>& clips) {
  if (clips.empty() || clips.size() > 3)
    throw InputError(where, std::to_string(clips.size()) + " sequences to draw",
                     "give one to three");
  for (const Clip& clip : clips) {
    if (clip.frames.empty())
      throw InputError(where, "\"" + clip.label + "\" has no frames", "give at least one");
    const size_t count = clip.frames.front().size();
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
  // between the 2nd and the 98th per cent: stray points of a scan do not move the view
  Point centre = Point::Zero();
  std::vector<float> values;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Point& p : points)
      if (p.allFinite()) values.push_back(p[axis]);
    if (values.empty()) return centre;
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 50);
    std::nth_element(values.begin(), low, values.end());
    const float first = *low;
    const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(values.size() / 50);
    std::nth_element(values.begin(), high, values.end());
    centre[axis] = 0.5f * (first + *high);
  }
  return centre;
}

float clip_floor(const Clip& clip) {
  std::vector<float> lowest, heights;
  for (const Points& points : clip.frames) {
    heights.clear();
    for (const Point& p : points)
      if (p.allFinite()) heights.push_back(p.y());
    if (heights.empty()) continue;
    const auto low = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 500);
    std::nth_element(heights.begin(), low, heights.end());
    lowest.push_back(*low);
  }
  if (lowest.empty()) return 0;
  const auto low = lowest.begin() + static_cast<std::ptrdiff_t>(lowest.size() / 50);
  std::nth_element(lowest.begin(), low, lowest.end());
  // Feet stand a little over or in the floor; data whose floor is y = 0 keeps it.
  return *low > -0.1f && *low < 0.1f ? 0 : *low;
}

}  // namespace restage
