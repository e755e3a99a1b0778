#include "nn/models/even_points.h"

#include <algorithm>

namespace restage {
namespace {

/// Where the cell of 1 cm that holds `p` lies on the Z curve (Morton 1966): the bits of the cell's
/// three numbers in turn. `p`: metres from the cloud's lowest corner.
uint64_t along_curve(const Point& p) {
  constexpr float kCells = 100;  // a metre
  constexpr int kBits = 21;
  uint64_t out = 0;
  for (int c = 0; c < 3; ++c) {
    const auto cell = static_cast<uint64_t>(std::min(p[c] * kCells, float{(1 << kBits) - 1}));
    for (int bit = 0; bit < kBits; ++bit) out |= ((cell >> bit) & 1) << (3 * bit + c);
  }
  return out;
}

}  // namespace

void EvenPoints::arrange(const Points& points) {
  row_.clear();
  if (points.empty()) return;
  Point low = points[0];
  for (const Point& p : points) low = low.cwiseMin(p);
  for (const Point& p : points) row_.push_back({along_curve(p - low), p});
  std::sort(row_.begin(), row_.end(), [](const Place& a, const Place& b) {
    if (a.cell != b.cell) return a.cell < b.cell;
    return std::lexicographical_compare(a.point.data(), a.point.data() + 3, b.point.data(),
                                        b.point.data() + 3);
  });
  const auto repeats = [](const Place& a, const Place& b) { return a.point == b.point; };
  row_.erase(std::unique(row_.begin(), row_.end(), repeats), row_.end());
  double cells = 0;
  for (auto first = row_.begin(); first != row_.end(); ++cells) {
    const auto last =
        std::find_if(first, row_.end(), [&](const Place& p) { return p.cell != first->cell; });
    const auto inside = static_cast<double>(last - first);
    for (double nth = 1; first != last; ++first, ++nth) first->upto = cells + nth / inside;
  }
}

void EvenPoints::choose(size_t n, double offset, Points* out) const {
  out->clear();
  const double step = row_.back().upto / static_cast<double>(n);
  auto place = row_.begin();
  for (size_t i = 0; i < n; ++i) {
    const double at = (static_cast<double>(i) + offset) * step;
    while (place + 1 != row_.end() && place->upto <= at) ++place;
    out->push_back(place->point);
  }
}

}  // namespace restage
