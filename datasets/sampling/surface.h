// Points drawn from surfaces, uniformly by area (spec 6.1).
#pragma once

#include <vector>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Points of a surface as three vertices and their barycentric weights each: the same samples can
/// be put on the rest surface and on any pose of it.
struct SurfaceSamples {
  std::vector<int32_t> vertices;  ///< three per point
  std::vector<float> weights;     ///< three per point, sum 1
  size_t size() const { return weights.size() / 3; }
  Points rest_vertices(const Body& body) const;  ///< those that `vertices` names
  /// The points, on the vertices that `vertices` names, in that order (pose_surface(..,
  /// &vertices)).
  Points on(const Points& picked) const;
  Points on_rest(const Body& body) const;
  Points on_pose(const Body& body, const Pose& pose) const;
  /// Skin weights of point `i`, 22; each side under the other's name in a mirror image.
  void skin_weights(const Body& body, size_t i, bool mirror, float* to) const;
};

/// Draws from one body. Areas are those of the rest surface, for every pose: measuring the posed
/// surface would mean posing all of it for every cloud. Skinning keeps areas but for stretched and
/// folded skin at joints.
class SurfaceSampler {
 public:
  /// InputError if the body has no faces, no area, or a face whose vertex does not exist.
  explicit SurfaceSampler(const Body& body);
  /// `n` independent points, so their order is random too. A function of key alone.
  SurfaceSamples draw(const RngKey& key, size_t n) const;
  /// Unit normals of the samples' triangles on picked vertices, out of the surface.
  Points normals(const SurfaceSamples& samples, const Points& picked) const;

 private:
  std::vector<Triangle> faces_;
  std::vector<double> ends_;  // cumulative areas
  float outwards_ = 1;        // -1: the faces are wound the other way
};

/// One sampler per body, in order.
std::vector<SurfaceSampler> surface_samplers(const std::vector<Body>& bodies);

/// Adds independent Gaussian noise of standard deviation `sigma` metres to each coordinate.
void add_noise(const RngKey& key, double sigma, Points& points);
Point centroid(const Points& points);

}  // namespace restage
