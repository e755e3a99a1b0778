#include "datasets/readers/clouds/non_finite.h"

namespace restage {

size_t keep_points(const std::vector<bool>& keep, Points& points, std::vector<Triangle>& faces) {
  std::vector<int32_t> index(points.size(), -1);
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!keep[i]) continue;
    index[i] = static_cast<int32_t>(kept);
    points[kept++] = points[i];
  }
  const size_t left_out = points.size() - kept;
  if (left_out == 0) return 0;
  points.resize(kept);
  std::erase_if(faces, [&](Triangle& face) {
    for (int32_t& corner : face) {
      corner = index[corner];
      if (corner < 0) return true;
    }
    return false;
  });
  return left_out;
}

size_t leave_out_non_finite(Points& points, std::vector<Triangle>& faces) {
  std::vector<bool> finite;
  for (const Point& p : points) finite.push_back(p.allFinite());
  return keep_points(finite, points, faces);
}

}  // namespace restage
