#include "infer/render/rasteriser.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "infer/render/shadow.h"
#include "infer/render/srgb.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

constexpr float kNear = 0.05f;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kFade = 1.7f;  // metres from the target at which the ground has faded away

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// 1 on a line of the half-metre grid, 0 beside it.
float grid_line(float x, float half_width) {
  constexpr float step = 0.5f;
  const float off = std::abs(x - step * std::round(x / step));
  return 1 - smooth_step(half_width * 0.6f, half_width * 1.4f, off);
}

}  // namespace

Colour colour_of(uint32_t srgb) {
  const auto channel = [&](int shift) {
    return srgb_to_linear(static_cast<float>((srgb >> shift) & 255u) / 255.0f);
  };
  return {channel(16), channel(8), channel(0)};
}

Canvas::Canvas(int width, int height, int samples, SceneStyle style)
    : width_(width * samples), height_(height * samples), samples_(samples), style_(style) {
  light_.resize(static_cast<size_t>(width_) * static_cast<size_t>(height_));
  depth_.resize(light_.size());
}

Canvas::Projected Canvas::project(const Point& p) const {
  if (!p.allFinite()) return {0, 0, -1};
  const Point at = axes_ * (p - eye_);
  const float z = -at.z();
  if (z < kNear) return {0, 0, -1};
  return {0.5f * static_cast<float>(width_) + focus_ * at.x() / z,
          0.5f * static_cast<float>(height_) - focus_ * at.y() / z, z};
}

void Canvas::begin(const Camera& camera, float floor, const Points& casts,
                   const std::vector<Triangle>& faces) {
  camera_ = camera;
  const float ca = std::cos(camera.azimuth), sa = std::sin(camera.azimuth);
  const float ce = std::cos(camera.elevation), se = std::sin(camera.elevation);
  const Point back(sa * ce, se, ca * ce);
  const Point right(ca, 0, -sa);
  axes_ << right.transpose(), back.cross(right).transpose(), back.transpose();
  eye_ = camera.target + camera.distance * back;
  focus_ = 0.5f * static_cast<float>(height_) / std::tan(0.5f * camera.view);
  std::fill(depth_.begin(), depth_.end(), kFar);
  const std::vector<float> shadow =
      shadow_map(camera.target, floor, key_light(axes_), casts, faces);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const Point ray =
          axes_.transpose() *
          Point((static_cast<float>(x) + 0.5f - 0.5f * static_cast<float>(width_)) / focus_,
                -(static_cast<float>(y) + 0.5f - 0.5f * static_cast<float>(height_)) / focus_, -1);
      const float reach = ray.y() < -1e-4f ? (floor - eye_.y()) / ray.y() : -1;
      // The ground also fades towards the edges of the picture, so that no edge is seen between
      // pictures that stand side by side.
      const float across = std::min(static_cast<float>(x), static_cast<float>(width_ - 1 - x)) /
                           static_cast<float>(width_);
      const float below = static_cast<float>(height_ - 1 - y) / static_cast<float>(height_);
      const float share = smooth_step(0, 0.22f, across) * smooth_step(0, 0.09f, below);
      const Colour ground =
          reach > 0 ? ground_at(eye_ + reach * ray, floor, shadow) : style_.background;
      pixel(x, y) = style_.background + share * (ground - style_.background);
    }
}

Colour Canvas::ground_at(const Point& at, float floor, const std::vector<float>& shadow) const {
  const float away = std::hypot(at.x() - camera_.target.x(), at.z() - camera_.target.z());
  const float here = 1 - smooth_step(0.35f * kFade, kFade, away);
  if (here <= 0) return style_.background;
  const float line = std::max(grid_line(at.x(), 0.008f), grid_line(at.z(), 0.008f));
  Colour colour = style_.ground + line * (style_.grid - style_.ground);
  colour = style_.background + here * (colour - style_.background);
  const float dark = shadow_at(shadow, camera_.target, Point(at.x(), floor, at.z()));
  return colour.cwiseProduct(Colour::Ones() - dark * Colour(0.80f, 0.74f, 0.66f));
}

/// The colour of a surface with unit normal `n` under four lights: from the sky, from the floor, a
/// warm main light from the camera's upper left, a cool light from behind.
Colour Canvas::shade(const Point& n, const Colour& colour) const {
  const float up = 0.5f + 0.5f * n.y();
  const Colour ambient = (1 - up) * Colour(0.27f, 0.25f, 0.24f) + up * Colour(0.42f, 0.46f, 0.52f);
  const float wrapped = std::max(0.0f, (n.dot(key_light(axes_)) + 0.25f) / 1.25f);
  const Colour key = wrapped * wrapped * Colour(1.05f, 0.98f, 0.90f);
  const Point eye = axes_.row(2);
  const float facing = std::max(0.0f, n.dot(eye));
  const float rim = std::pow(1 - facing, 3.0f) * (0.4f + 0.6f * up);
  const Point half = (eye + key_light(axes_)).normalized();
  const float gloss = 0.10f * std::pow(std::max(0.0f, n.dot(half)), 24.0f);
  return colour.cwiseProduct(ambient + key) + (0.12f * rim + gloss) * Colour(0.9f, 0.95f, 1.0f);
}

template <class Paint>
void Canvas::fill_triangle(const Projected* c, const Paint& paint) {
  const float area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
  if (!(std::abs(area) > 1e-6f)) return;
  const float low_x = std::min({c[0].x, c[1].x, c[2].x}),
              high_x = std::max({c[0].x, c[1].x, c[2].x});
  const float low_y = std::min({c[0].y, c[1].y, c[2].y}),
              high_y = std::max({c[0].y, c[1].y, c[2].y});
  // Clamped before the conversion: the numbers may be far outside the range of int.
  const int x0 = static_cast<int>(std::clamp(low_x, 0.0f, static_cast<float>(width_)));
  const int x1 = static_cast<int>(std::clamp(high_x + 1, 0.0f, static_cast<float>(width_)));
  const int y0 = static_cast<int>(std::clamp(low_y, 0.0f, static_cast<float>(height_)));
  const int y1 = static_cast<int>(std::clamp(high_y + 1, 0.0f, static_cast<float>(height_)));
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
      const float b =
          ((px - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (py - c[0].y)) / area;
      const float d =
          ((c[1].x - c[0].x) * (py - c[0].y) - (px - c[0].x) * (c[1].y - c[0].y)) / area;
      const float a = 1 - b - d;
      if (a < 0 || b < 0 || d < 0) continue;
      const float z = 1 / (a / c[0].z + b / c[1].z + d / c[2].z);
      if (!(z < depth(x, y))) continue;
      const Rgba seen = paint(Point(a, b, d), z);
      if (!(seen[3] > 0)) continue;
      // What is nearly opaque hides what is behind it, also if that is drawn later.
      if (seen[3] > 0.95f) depth(x, y) = z;
      const Colour behind = seen[3] < 1 ? pixel(x, y) : Colour(seen.head<3>());
      pixel(x, y) = seen.head<3>() + (1 - seen[3]) * (behind - seen.head<3>());
    }
}

void Canvas::draw_mesh(const Points& vertices, const std::vector<Triangle>& faces,
                       const Colour& colour) {
  const Points normals = vertex_normals<Point>(vertices, faces, Point::UnitY());
  std::vector<Projected> projected(vertices.size());
  for (size_t v = 0; v < vertices.size(); ++v) projected[v] = project(vertices[v]);
  for (const Triangle& f : faces) {
    const Projected corners[3] = {projected[f[0]], projected[f[1]], projected[f[2]]};
    if (!corners[0].in_front() || !corners[1].in_front() || !corners[2].in_front()) continue;
    const Point out = (vertices[f[1]] - vertices[f[0]]).cross(vertices[f[2]] - vertices[f[0]]);
    // In open surfaces, or where corners are listed the other way round, a triangle is seen from
    // behind. Such a triangle is lit as if it faced the camera.
    const float side = out.dot(eye_ - vertices[f[0]]) < 0 ? -1.0f : 1.0f;
    fill_triangle(corners, [&](const Point& share, float) {
      const Point n =
          share[0] * normals[f[0]] + share[1] * normals[f[1]] + share[2] * normals[f[2]];
      Rgba seen;
      seen << shade(side * n.normalized(), colour), 1;
      return seen;
    });
  }
}

/// A triangle of a surface with materials.
struct Canvas::Facet {
  const Triangle* face;
  const Material* material;
  Projected corners[3];
  float side, distance;  // distance: of its middle from the eye
};

/// Triangles that are in view, in the order in which they are drawn: what is solid, then what is
/// seen through, the farthest first.
std::vector<Canvas::Facet> Canvas::facets(const Points& vertices,
                                          const std::vector<Triangle>& faces,
                                          const Appearance& look) const {
  std::vector<Projected> projected(vertices.size());
  for (size_t v = 0; v < vertices.size(); ++v) projected[v] = project(vertices[v]);
  std::vector<Facet> out;
  for (size_t t = 0; t < faces.size(); ++t) {
    const Triangle& f = faces[t];
    const Facet facet{&f,
                      &look.materials[static_cast<size_t>(look.material[t])],
                      {projected[f[0]], projected[f[1]], projected[f[2]]},
                      (vertices[f[1]] - vertices[f[0]])
                                  .cross(vertices[f[2]] - vertices[f[0]])
                                  .dot(eye_ - vertices[f[0]]) < 0
                          ? -1.0f
                          : 1.0f,
                      projected[f[0]].z + projected[f[1]].z + projected[f[2]].z};
    if (facet.side < 0 && !facet.material->two_sided) continue;
    if (facet.corners[0].in_front() && facet.corners[1].in_front() && facet.corners[2].in_front())
      out.push_back(facet);
  }
  const auto solid = [](const Facet& facet) {
    return facet.material->alpha != Material::Alpha::blend;
  };
  const auto middle = std::stable_partition(out.begin(), out.end(), solid);
  std::stable_sort(middle, out.end(),
                   [](const Facet& a, const Facet& b) { return a.distance > b.distance; });
  return out;
}

void Canvas::draw_surface(const Points& vertices, const std::vector<Triangle>& faces,
                          const Appearance& look, const Pictures& pictures) {
  const Points normals = vertex_normals<Point>(vertices, faces, Point::UnitY(), look.smooth);
  for (const Facet& facet : facets(vertices, faces, look)) {
    const Triangle& f = *facet.face;
    const Material& material = *facet.material;
    const auto picture_of = [&](const Texture& texture) -> const TexturePicture* {
      const bool is_there = texture.picture >= 0 && !look.uv.empty() &&
                            pictures[static_cast<size_t>(texture.picture)];
      return is_there ? &*pictures[static_cast<size_t>(texture.picture)] : nullptr;
    };
    const TexturePicture* picture = picture_of(material.texture);
    const TexturePicture* glow = picture_of(material.glow_texture);
    const float texels = picture ? texels_of(facet, look, material.texture, *picture) : 1;
    fill_triangle(facet.corners, [&](const Point& share, float z) -> Rgba {
      // Shares of the corners on the surface, which perspective makes others than in the picture.
      const Point s(share[0] * z / facet.corners[0].z, share[1] * z / facet.corners[1].z,
                    share[2] * z / facet.corners[2].z);
      const auto mixed = [&](const auto& list) {
        return (s[0] * list[f[0]] + s[1] * list[f[1]] + s[2] * list[f[2]]).eval();
      };
      Rgba seen = material.colour;
      const Uv place = look.uv.empty() ? Uv(0, 0) : mixed(look.uv);
      if (picture) seen = seen.cwiseProduct(picture->at(material.texture, place, texels));
      if (!look.colours.empty()) seen = seen.cwiseProduct(mixed(look.colours));
      if (material.alpha == Material::Alpha::mask && seen[3] < material.cutoff)
        seen[3] = 0;
      else if (material.alpha != Material::Alpha::blend)
        seen[3] = 1;
      if (!(seen[3] > 0)) return Rgba::Zero();
      if (!material.unlit) {
        const Point n = mixed(normals);
        seen.head<3>() = shade(facet.side * n.normalized(), seen.head<3>());
      }
      Colour light = material.glow;
      if (glow) light = light.cwiseProduct(glow->at(material.glow_texture, place, 1).head<3>());
      seen.head<3>() += light;
      return seen;
    });
  }
}

/// How many texels lie, along one axis, in a sample of the triangle.
float Canvas::texels_of(const Facet& facet, const Appearance& look, const Texture& texture,
                        const TexturePicture& picture) {
  const Triangle& f = *facet.face;
  const auto& c = facet.corners;
  const Eigen::Matrix2f turn = texture.transform.leftCols<2>();
  const Uv a = turn * (look.uv[f[1]] - look.uv[f[0]]), b = turn * (look.uv[f[2]] - look.uv[f[0]]);
  const float texels = std::abs(a.x() * b.y() - a.y() * b.x()) *
                       static_cast<float>(picture.width()) * static_cast<float>(picture.height());
  const float samples =
      std::abs((c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y));
  return samples > 0 ? std::sqrt(texels / samples) : 1;
}

void Canvas::draw_cloud(const Points& points, const Colour& colour) {
  // A person has about 1.8 square metres of skin. The spheres' radius follows from that and from
  // their number: neighbours nearly touch.
  const float size =
      std::clamp(0.42f * std::sqrt(1.8f / static_cast<float>(points.size() + 1)), 0.004f, 0.016f);
  for (const Point& p : points) {
    const Projected c = project(p);
    if (!c.in_front()) continue;
    const float radius = std::max(0.7f * static_cast<float>(samples_), focus_ * size / c.z);
    // The far side of a person can be seen between the spheres of the near side. The far side is
    // drawn paler, so that the near side looks like a surface.
    const float far = 0.45f * smooth_step(-0.12f, 0.30f, c.z - camera_.distance);
    fill_sphere(c, radius, size, colour + far * (style_.background - colour));
  }
}

void Canvas::fill_sphere(const Projected& c, float radius, float size, const Colour& colour) {
  const int x0 = static_cast<int>(std::clamp(c.x - radius, 0.0f, static_cast<float>(width_)));
  const int x1 = static_cast<int>(std::clamp(c.x + radius + 1, 0.0f, static_cast<float>(width_)));
  const int y0 = static_cast<int>(std::clamp(c.y - radius, 0.0f, static_cast<float>(height_)));
  const int y1 = static_cast<int>(std::clamp(c.y + radius + 1, 0.0f, static_cast<float>(height_)));
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const float u = (static_cast<float>(x) + 0.5f - c.x) / radius;
      const float v = (c.y - static_cast<float>(y) - 0.5f) / radius;
      const float square = u * u + v * v;
      if (square > 1) continue;
      const float w = std::sqrt(1 - square);
      const float z = c.z - w * size;
      if (!(z < depth(x, y))) continue;
      depth(x, y) = z;
      pixel(x, y) = shade(axes_.transpose() * Point(u, v, w), colour);
    }
}

/// Ambient occlusion: darkens a sample whose neighbours in the picture are nearer to the camera, by
/// a fine outline and by a wide soft shade.
void Canvas::occlude() {
  struct Ring {
    float metres, reach, strength;
  };
  constexpr Ring rings[2] = {{0.012f, 0.05f, 0.35f}, {0.05f, 0.16f, 0.55f}};
  constexpr int kDirections = 12;
  float cosines[2][kDirections], sines[2][kDirections];  // of neighbouring samples, by turns
  for (int odd = 0; odd < 2; ++odd)
    for (int d = 0; d < kDirections; ++d) {
      const float angle =
          6.2831853f * (static_cast<float>(d) + 0.5f * static_cast<float>(odd)) / kDirections;
      cosines[odd][d] = std::cos(angle);
      sines[odd][d] = std::sin(angle);
    }
  std::vector<float> keep(depth_.size(), 1);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const float z = depth(x, y);
      if (z == kFar) continue;
      float dark = 0;
      for (const Ring& ring : rings) {
        const float pixels = focus_ * ring.metres / z;
        float sum = 0;
        for (int d = 0; d < kDirections; ++d) {
          const int odd = (x + y) & 1;
          const int nx = x + static_cast<int>(std::lround(pixels * cosines[odd][d]));
          const int ny = y + static_cast<int>(std::lround(pixels * sines[odd][d]));
          if (nx < 0 || ny < 0 || nx >= width_ || ny >= height_) continue;
          const float step = (z - depth(nx, ny)) / ring.reach;  // -infinity before the background
          if (step > 0.05f) sum += std::min(1.0f, step) * std::exp(-0.35f * step);
        }
        dark += ring.strength * sum / kDirections;
      }
      keep[y * width_ + x] = std::exp(-1.6f * dark);
    }
  for (size_t k = 0; k < keep.size(); ++k) light_[k] *= keep[k];
}

Image Canvas::image() {
  occlude();
  Image image(width_ / samples_, height_ / samples_, {0, 0, 0});
  const float share = 1.0f / static_cast<float>(samples_ * samples_);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      Colour sum = Colour::Zero();
      for (int j = 0; j < samples_; ++j)
        for (int i = 0; i < samples_; ++i)
          sum += pixel(x * samples_ + i, y * samples_ + j).cwiseMin(1.0f);
      for (int k = 0; k < 3; ++k)
        image.rgb[3 * static_cast<size_t>(y * image.width + x) + static_cast<size_t>(k)] =
            static_cast<uint8_t>(
                std::lround(255 * std::clamp(linear_to_srgb(share * sum[k]), 0.0f, 1.0f)));
    }
  return image;
}

}  // namespace restage
