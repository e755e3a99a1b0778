#include "datasets/sampling/surface.h"

#include <algorithm>
#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/sampling/normals.h"

namespace restage {
namespace {

float unit(uint32_t word) { return static_cast<float>(word >> 8) * 0x1.0p-24f; }

}  // namespace

Points SurfaceSamples::on(const Points& picked) const {
  if (picked.size() != vertices.size())
    throw ShapeError(
        cat("SurfaceSamples::on: ", picked.size(), " vertices for ", size(), " points of three"));
  Points out(size());
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = weights[3 * i] * picked[3 * i] + weights[3 * i + 1] * picked[3 * i + 1] +
             weights[3 * i + 2] * picked[3 * i + 2];
  return out;
}

Points SurfaceSamples::rest_vertices(const Body& body) const {
  Points picked(vertices.size());
  for (size_t i = 0; i < picked.size(); ++i) picked[i] = body.rest.vertices.at(vertices[i]);
  return picked;
}

Points SurfaceSamples::on_rest(const Body& body) const { return on(rest_vertices(body)); }

Points SurfaceSamples::on_pose(const Body& body, const Pose& pose) const {
  return on(pose_surface(body, pose, &vertices));
}

void SurfaceSamples::skin_weights(const Body& body, size_t i, bool mirror, float* to) const {
  std::fill_n(to, kJoints, 0.0f);
  for (size_t corner = 3 * i; corner < 3 * i + 3; ++corner)
    for (int j = 0; j < kJoints; ++j)
      to[mirror ? kMirror[j] : j] += weights[corner] * body.weights(vertices[corner], j);
}

SurfaceSampler::SurfaceSampler(const Body& body) : faces_(body.rest.faces) {
  const Points& x = body.rest.vertices;
  const std::string where = "body '" + body.id + "'";
  ends_.reserve(faces_.size());
  double sum = 0, volume = 0;
  for (const Triangle& f : faces_) {
    for (const int32_t v : f)
      if (v < 0 || static_cast<size_t>(v) >= x.size())
        throw InputError(where, cat("a face names vertex ", v, " of ", x.size()), "mend the mesh");
    const Point &a = x[f[0]], &b = x[f[1]], &c = x[f[2]];
    sum += 0.5 * static_cast<double>((b - a).cross(c - a).norm());
    volume += static_cast<double>(a.dot(b.cross(c)));
    ends_.push_back(sum);
  }
  outwards_ = volume < 0 ? -1.0f : 1.0f;
  if (!(sum > 0) || !std::isfinite(sum))
    throw InputError(where, "no surface to draw points from", "give a mesh with triangles");
}

SurfaceSamples SurfaceSampler::draw(const RngKey& key, size_t n) const {
  SurfaceSamples out;
  out.vertices.resize(3 * n);
  out.weights.resize(3 * n);
  const double scale = ends_.back() * 0x1.0p-32;
  for (size_t i = 0; i < n; ++i) {
    const auto word = philox(key, i);
    const auto end = std::upper_bound(ends_.begin(), ends_.end(), scale * word[0]);
    const auto face = std::min<size_t>(static_cast<size_t>(end - ends_.begin()), ends_.size() - 1);
    float u = unit(word[1]), v = unit(word[2]);
    if (u + v > 1.0f) {
      u = 1.0f - u;
      v = 1.0f - v;
    }
    std::copy(faces_[face].begin(), faces_[face].end(), out.vertices.begin() + 3 * i);
    out.weights[3 * i] = 1.0f - u - v;
    out.weights[3 * i + 1] = u;
    out.weights[3 * i + 2] = v;
  }
  return out;
}

Points SurfaceSampler::normals(const SurfaceSamples& samples, const Points& picked) const {
  Points out(samples.size());
  for (size_t i = 0; i < out.size(); ++i) {
    const Point &a = picked[3 * i], &b = picked[3 * i + 1], &c = picked[3 * i + 2];
    out[i] = outwards_ * (b - a).cross(c - a).stableNormalized();
  }
  return out;
}

std::vector<SurfaceSampler> surface_samplers(const std::vector<Body>& bodies) {
  std::vector<SurfaceSampler> out;
  out.reserve(bodies.size());
  for (const Body& body : bodies) out.emplace_back(body);
  return out;
}

void add_noise(const RngKey& key, double sigma, Points& points) {
  if (sigma == 0) return;
  for (size_t i = 0; i < points.size(); ++i)
    points[i] += static_cast<float>(sigma) * normal3(key, i);
}

Point centroid(const Points& points) {
  Vec3 sum = Vec3::Zero();
  for (const Point& p : points) sum += p.cast<double>();
  return (sum / static_cast<double>(std::max<size_t>(1, points.size()))).cast<float>();
}

}  // namespace restage
