// How believable posed bodies are: what `restage data realism` prints and docs/benchmark.md quotes.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Volume about a joint, bent by `angle` (radians) with the surface's usual skinning, as a share of
/// that at rest: the cone from the joint to the skin within 35 % of its two bones. `near`, `joint`,
/// `far` as in (hip, knee, ankle). `linear` by linear blend skinning instead, for comparison.
struct BentVolume {
  double ours = 0, linear = 0;
};
BentVolume bent_volume(const Body& body, int near, int joint, int far, double angle);

/// How often a closed surface winds around a point: 1 inside, 0 outside, between at holes.
double winding_number(const Points& surface, const std::vector<Triangle>& faces, const Vec3& at);

/// Joints that lie inside the posed surface, of 22; the names of the others are added to `outside`.
int joints_inside(const Body& body, const Points& surface, const Joints& joints,
                  std::vector<std::string>* outside = nullptr);

/// Share of the rest surface, of every `step`-th vertex moved 3 mm outwards, that lies inside
/// another part of it. `where` (may be null) gets the joint that moves each such vertex.
double buried_share(const Body& body, size_t step = 8, std::vector<std::string>* where = nullptr);

/// Heights and speeds of the lowest points of a motion on a body, metres.
struct FootContact {
  std::vector<double> lowest;  ///< per frame
  std::vector<double>
      slipping;  ///< metres per second, of points that stay within 1 cm of the floor
};
FootContact foot_contact(const Motion& motion, const Body& body,
                         const std::vector<int32_t>& vertices);

struct RealismReport {
  size_t bodies = 0, motions = 0, frames = 0;
  BentVolume knee_mean, elbow_mean, knee_least, elbow_least;  ///< bent by 90 degrees
  double joints_inside_rest = 0, joints_inside_posed = 0;     ///< shares; posed: one frame a clip
  double buried = 0;                                          ///< mean over bodies
  /// Joints that were outside, and joints whose skin is buried: "name (count)", most first.
  std::vector<std::string> outside, buried_at;
  /// Lowest point over all bodies and frames: percentiles 0, 1, 50, 99, 100, metres.
  std::vector<double> lowest;
  double on_floor = 0;  ///< share of frames whose lowest point is within 2 cm of the floor
  double slipping = 0;  ///< median, metres per second
};

/// Feet on all bodies in all frames, joints of one frame of each motion, the rest on all bodies.
RealismReport measure_realism(const std::vector<Body>& bodies, const std::vector<Motion>& motions);

}  // namespace restage
