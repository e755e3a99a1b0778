// One mesh over all scans of a take: a person's own body, posed and deformed until it lies on each
// cloud (docs/design/track.md).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "infer/track/pose_fit.h"
#include "infer/track/surface_distance.h"
#include "infer/track/surface_fit.h"

namespace restage {

/// Where a file's bones put the vertices of a body in a pose.
struct FileSkin {
  std::vector<Vec3> vertices;  ///< in the world, metres
  std::vector<Mat3> blends;    ///< of each, what takes offsets as the file stores them to the world
};

struct TrackOptions {
  size_t nodes = 400;  ///< of the graph that deforms the surface
  /// Of a template whose own file poses it; empty: the body's joints and weights do.
  std::function<FileSkin(const Pose&)> skin;
  PoseFitOptions pose;
  SurfaceFitOptions surface;
  bool deform = true;  ///< false: the surface is what the pose makes of it
};

struct TrackedFrame {
  Pose pose;
  Points vertices;  ///< in the world, metres, in the template's order
  /// By how much each vertex has to be elsewhere at rest so that skinning puts it where it is;
  /// metres, in the axes of the file that TrackOptions::skin is of.
  Points offsets;
  /// From the points of the cloud to the surface; nothing in a frame without a cloud.
  std::optional<MiddleAndMost> distance;
};

/// Frames go in one by one; memory does not grow with their number.
class Tracker {
 public:
  /// `body`: the template in T-pose; of its skin weights the four strongest of each vertex count,
  /// as in a glTF file. `where` names it in errors. InputError: see make_surface_graph().
  Tracker(Body body, const std::string& where, TrackOptions options = {});

  /// `chain`: the template's pose as the networks give it. `seen`: the joints that they saw in the
  /// cloud, in its place; null: `chain` is as far from its place as in the frame before. `cloud`:
  /// null in a frame without one: then the surface keeps what was found before. UnusableCloud
  /// naming `source`.
  TrackedFrame operator()(const Pose& chain, const Joints* seen, const Points* cloud,
                          const std::string& source);
  const Body& body() const { return body_; }
  /// How long a metre of TrackedFrame::offsets is as the file stores it.
  double stored_metre() const { return stored_metre_; }
  /// The vertices in a pose, moved by offsets.
  std::vector<Vec3> surface(const Pose& pose, const Points& offsets) const;

  /// What later frames depend on. load() takes what save() of a tracker of the same body and
  /// options gave, and goes on from there with the same bits. InputError naming `where`: it is of
  /// another.
  std::string save() const;
  void load(const std::string& state, const std::string& where);

 private:
  FileSkin skin(const Pose& pose) const;
  Pose start(const Pose& chain, const Joints* seen) const;
  std::vector<Mat3> node_turns(const PosedSkeleton& posed) const;
  void unskin(const FileSkin& skin, TrackedFrame* frame) const;

  Body body_;
  TrackOptions options_;
  SurfaceFit surface_;
  SurfaceDistance distance_;
  double stored_metre_ = 1;
  // Of the frame before that had a cloud:
  Rotations correction_;       ///< of the chain's local rotations; the pelvis' in its axes
  Vec3 moved_ = Vec3::Zero();  ///< from the chain's pelvis to the one that was found
};

}  // namespace restage
