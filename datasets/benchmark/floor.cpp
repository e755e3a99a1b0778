#include "datasets/benchmark/floor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/importers/batches.h"
#include "nn/geometry/soles.h"

namespace restage {

std::vector<int32_t> outermost_vertices(const Body& body) {
  std::vector<int32_t> out;
  const Points& x = body.rest.vertices;
  std::array<std::vector<int32_t>, kJoints> of_joint;
  for (size_t v = 0; v < x.size(); ++v) {
    Eigen::Index joint = 0;
    body.weights.row(v).maxCoeff(&joint);
    of_joint[joint].push_back(static_cast<int32_t>(v));
  }
  for (const std::vector<int32_t>& part : of_joint)
    for (const int32_t vertex : outermost(x, part)) out.push_back(vertex);
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<double> lowest_heights(const Motion& motion, const Body& body,
                                   const std::vector<int32_t>& vertices) {
  std::vector<double> out(motion.frames());
  parallel_for(out.size(), 16, [&](int64_t begin, int64_t end) {
    for (int64_t f = begin; f < end; ++f) {
      double lowest = std::numeric_limits<double>::infinity();
      for (const Point& p : pose_surface(body, pose_on(motion, body, f), &vertices))
        lowest = std::min(lowest, static_cast<double>(p.y()));
      out[f] = lowest;
    }
  });
  return out;
}

std::vector<double> lower_envelope(const std::vector<double>& heights, size_t half) {
  const size_t n = heights.size();
  std::vector<double> least(n), out(n);
  const auto span = [&](size_t i) {
    return std::pair{i > half ? i - half : 0, std::min(n - 1, i + half)};
  };
  for (size_t i = 0; i < n; ++i) {
    const auto [from, to] = span(i);
    least[i] = heights[from];
    for (size_t k = from; k <= to; ++k) least[i] = std::min(least[i], heights[k]);
  }
  for (size_t i = 0; i < n; ++i) {
    const auto [from, to] = span(i);
    double sum = 0;
    for (size_t k = from; k <= to; ++k) sum += least[k];
    out[i] = std::min(heights[i], sum / static_cast<double>(to - from + 1));
  }
  return out;
}

Motion on_floor(const Motion& motion, const Body& body, const std::vector<int32_t>& vertices,
                double window) {
  if (!(window > 0) || motion.frames() == 0) return motion;
  const auto half = static_cast<size_t>(std::lround(0.5 * window * kFps));
  const std::vector<double> floor = lower_envelope(lowest_heights(motion, body, vertices), half);
  // How much a metre of the motion's hips moves this body (pose_on): asked, not computed again.
  Motion raised = motion;
  raised.hips[0].y() += 1;
  const double scale = pose_on(raised, body, 0).root.y() - pose_on(motion, body, 0).root.y();
  Motion out = motion;
  for (size_t f = 0; f < floor.size(); ++f) out.hips[f].y() -= static_cast<float>(floor[f] / scale);
  return out;
}

}  // namespace restage
