// Metrics of surfaces, which come some frames at a time: five minutes of 13,380 vertices are 2.9 GB
// of float64. Every meter adds up in the order of frames, whatever the size of the pieces, so that
// its bits do not depend on it.
#pragma once

#include <span>

#include "nn/metrics/metrics.h"

namespace restage::metrics {

/// What one metric gathers from the surfaces of one sequence.
class SurfaceMeter {
 public:
  virtual ~SurfaceMeter() = default;
  /// The next frames: some of each track, as many of both.
  virtual void add(const Track& pred, const Track& truth) = 0;
  /// After the last frame: whether it wants to see all frames once more.
  virtual bool again() { return false; }
  virtual Value value() const = 0;
};

/// Mean distance of vertices (MPVD, PA-MPVD), metres.
std::unique_ptr<SurfaceMeter> distance_meter(const Alignment& how);
/// MEDL: mean |edge length - true edge length| over the edges to the 6 nearest other points of the
/// ground truth, millimetres; needs 7 points, and a finite truth.
std::unique_ptr<SurfaceMeter> edge_meter(NeighbourFrame where);
/// LART equation 5: mean squared distance over frames and points, square metres.
std::unique_ptr<SurfaceMeter> squared_meter();
/// NPT's script: mean squared coordinate difference with bounding boxes centred, square metres.
std::unique_ptr<SurfaceMeter> squared_npt_meter();
/// floor_penetration_mm().
std::unique_ptr<SurfaceMeter> floor_meter();
/// leaf_vertex_distance(); null unless `joints` are the 22 of the truth.
std::unique_ptr<SurfaceMeter> leaf_meter(const Track& joints);

/// Shows all frames to all meters (null: none) until none wants more.
void measure(const Surfaces& pred, const Surfaces& truth,
             std::span<const std::unique_ptr<SurfaceMeter>> meters);

/// The value that a share of the others is below.
Value percentile(std::vector<double> values, double share);

}  // namespace restage::metrics
