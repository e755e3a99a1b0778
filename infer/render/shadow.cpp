#include "infer/render/shadow.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr int kSize = 320;         // texels a side
constexpr float kExtent = 4.0f;    // metres a side
constexpr float kContact = 0.22f;  // metres: below this height things throw the dark, sharp shadow
constexpr float kScale = kSize / kExtent;

struct Texel {
  float x, y;
};

using Map = std::vector<float>;

void fill(Map& map, const Texel& a, const Texel& b, const Texel& c) {
  const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(std::abs(area) > 1e-9f)) return;
  const auto bound = [](float v) {
    return static_cast<int>(std::clamp(v, 0.0f, static_cast<float>(kSize)));
  };
  for (int y = bound(std::min({a.y, b.y, c.y})); y < bound(std::max({a.y, b.y, c.y}) + 1); ++y)
    for (int x = bound(std::min({a.x, b.x, c.x})); x < bound(std::max({a.x, b.x, c.x}) + 1); ++x) {
      const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
      const float s = ((px - a.x) * (c.y - a.y) - (c.x - a.x) * (py - a.y)) / area;
      const float t = ((b.x - a.x) * (py - a.y) - (px - a.x) * (b.y - a.y)) / area;
      if (s >= 0 && t >= 0 && s + t <= 1) map[y * kSize + x] = 1;
    }
}

/// Draws one point of a cloud as a disc of about 3.5 cm, which is how far apart the points of a
/// cloud are; the blur closes what gaps are left.
void stamp(Map& map, const Texel& at) {
  constexpr int r = 2;
  if (!(at.x > -r && at.y > -r && at.x < kSize + r && at.y < kSize + r)) return;
  for (int y = static_cast<int>(at.y) - r; y <= static_cast<int>(at.y) + r; ++y)
    for (int x = static_cast<int>(at.x) - r; x <= static_cast<int>(at.x) + r; ++x)
      if (x >= 0 && y >= 0 && x < kSize && y < kSize) map[y * kSize + x] = 1;
}

/// Replaces every texel by the mean of 2 r + 1 texels along one direction.
void blur_lines(Map& map, int r, int step, int line) {
  std::vector<float> sums(kSize + 1);
  for (int l = 0; l < kSize; ++l) {
    for (int k = 0; k < kSize; ++k) sums[k + 1] = sums[k] + map[l * line + k * step];
    for (int k = 0; k < kSize; ++k)
      map[l * line + k * step] = (sums[std::min(kSize, k + r + 1)] - sums[std::max(0, k - r)]) /
                                 static_cast<float>(2 * r + 1);
  }
}

void blur(Map& map, int r) {
  for (int pass = 0; pass < 3; ++pass) {  // three means in a row are nearly a Gaussian
    blur_lines(map, r, 1, kSize);
    blur_lines(map, r, kSize, 1);
  }
}

}  // namespace

Point key_light(const Eigen::Matrix3f& axes) {
  return (axes.transpose() * Point(-0.55f, 0, 0.62f) + Point(0, 0.95f, 0)).normalized();
}

std::vector<float> shadow_map(const Point& centre, float floor, const Point& light,
                              const Points& casts, const std::vector<Triangle>& faces) {
  Map wide(static_cast<size_t>(kSize) * kSize, 0.0f), contact = wide;
  const auto texel = [&](const Point& p, float tilt) {
    const float over = tilt * (p.y() - floor) / light.y();
    return Texel{(p.x() - over * light.x() - centre.x()) * kScale + 0.5f * kSize,
                 (p.z() - over * light.z() - centre.z()) * kScale + 0.5f * kSize};
  };
  const auto near_floor = [&](const Point& p) { return p.y() - floor < kContact; };
  for (const Triangle& f : faces) {
    const Point &a = casts[f[0]], &b = casts[f[1]], &c = casts[f[2]];
    if (!a.allFinite() || !b.allFinite() || !c.allFinite()) continue;
    fill(wide, texel(a, 1), texel(b, 1), texel(c, 1));
    if (near_floor(a)) fill(contact, texel(a, 0.3f), texel(b, 0.3f), texel(c, 0.3f));
  }
  if (faces.empty())
    for (const Point& p : casts) {
      if (!p.allFinite()) continue;
      stamp(wide, texel(p, 1));
      if (near_floor(p)) stamp(contact, texel(p, 0.3f));
    }
  blur(wide, 4);
  blur(contact, 2);
  for (size_t k = 0; k < wide.size(); ++k)
    wide[k] = 1 - (1 - 0.34f * wide[k]) * (1 - 0.42f * contact[k]);
  return wide;
}

float shadow_at(const std::vector<float>& map, const Point& centre, const Point& at) {
  const float x = (at.x() - centre.x()) * kScale + 0.5f * kSize - 0.5f;
  const float y = (at.z() - centre.z()) * kScale + 0.5f * kSize - 0.5f;
  if (!(x >= 0 && y >= 0 && x < kSize - 1 && y < kSize - 1)) return 0;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const float u = x - static_cast<float>(i), v = y - static_cast<float>(j);
  const float* at_texel = &map[j * kSize + i];
  return (1 - v) * ((1 - u) * at_texel[0] + u * at_texel[1]) +
         v * ((1 - u) * at_texel[kSize] + u * at_texel[kSize + 1]);
}

}  // namespace restage
