#include "nn/geometry/strays.h"

#include <algorithm>

#include "nn/geometry/box.h"

namespace restage {

size_t leave_out_strays(const Points& cloud, Points* kept) {
  if (cloud.empty() || box_of(cloud).sizes().maxCoeff() <= kStrayDistance) return 0;
  Point middle;
  std::vector<float> along(cloud.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(cloud.begin(), cloud.end(), along.begin(),
                   [axis](const Point& p) { return p[axis]; });
    const auto half = along.begin() + std::ssize(along) / 2;
    std::nth_element(along.begin(), half, along.end());
    middle[axis] = *half;
  }
  const auto near = [&](const Point& p) {
    return (p - middle).cwiseAbs().maxCoeff() <= kStrayDistance;
  };
  const auto strays =
      cloud.size() - static_cast<size_t>(std::count_if(cloud.begin(), cloud.end(), near));
  if (strays > std::max<size_t>(1, cloud.size() / kStrayShare) || strays == 0) return 0;
  kept->clear();
  std::copy_if(cloud.begin(), cloud.end(), std::back_inserter(*kept), near);
  return strays;
}

}  // namespace restage
