// Deterministic lists of what held-out bodies and clips are judged on, and the clouds, joints and
// vertices of each. Give them a corpus of one split only: subset(corpus, "validation").
#pragma once

#include <vector>

#include "datasets/corpus.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/surface.h"

namespace restage {

/// `count` posed clouds: bodies in turn, frames spread over all motions, random headings, no
/// mirror. For CloudSampler::clouds().
std::vector<CloudSubject> evaluation_clouds(const Corpus& corpus, size_t count, uint64_t seed);
/// The T-pose of every body, `per_body` times, turned by up to `heading` degrees.
std::vector<CloudSubject> evaluation_tposes(const Corpus& corpus, size_t per_body, double heading,
                                            uint64_t seed);

/// `count` of them, each for `frames` frames, one sequence after the other.
std::vector<CloudSubject> following(const Corpus& corpus, const std::vector<CloudSubject>& subjects,
                                    size_t count, size_t frames);

struct EvaluationScans {
  int cameras = 1;        ///< before, beside or behind somebody; more than one: a ring
  int points = 512;       ///< of each cloud
  bool intruder = false;  ///< with a limb of somebody else beside them
  size_t frames = 1;      ///< subjects after each other that are of one scene
};
/// What depth cameras measure of the subjects, dressed, by ray casting (scanner.h), relative to the
/// centroid of each cloud. A scene's subjects wear the same clothes before the same cameras.
CloudBatch evaluation_scans(const Corpus& corpus, const std::vector<CloudSubject>& subjects,
                            const EvaluationScans& how, uint64_t seed);

/// Body A's performance of part of a motion, to be retargeted to body B. Indices into a corpus.
struct EvalSequence {
  size_t body_a = 0, body_b = 0, motion = 0;
  size_t first = 0, frames = 0;
};

/// `count` sequences of `frames` frames (the whole motion where it is shorter): motions in turn in
/// random order, A and B different. InputError if there is no motion or fewer than two bodies.
std::vector<EvalSequence> evaluation_sequences(const Corpus& corpus, size_t count, size_t frames,
                                               uint64_t seed);

/// How scans of a sequence are made.
struct ScanConfig {
  int least = 900, most = 1400;  ///< points per frame
  double noise = 0.005;          ///< standard deviation per coordinate, metres
  /// Nothing is seen within so many metres of one point of the body, which is another in each
  /// sequence and stays where it is on the body.
  double hole = 0;

  bool operator==(const ScanConfig&) const = default;
};

/// Everything about one sequence, frame by frame, in the world. Keeps a reference to `corpus`.
class Performance {
 public:
  Performance(const Corpus& corpus, const EvalSequence& sequence, const ScanConfig& scan,
              uint64_t seed);

  size_t frames() const { return sequence_.frames; }
  const Body& source() const { return a_; }
  const Body& target() const { return b_; }
  const Motion& motion() const { return motion_; }

  /// A's scan in frame i: count, noise and order change from frame to frame.
  Points cloud(size_t i) const;
  /// B's T-pose as a scan of `points` points (0: the mean of ScanConfig's counts).
  Points target_cloud(size_t points = 0) const;
  Pose pose_a(size_t i) const;  ///< relative to A's rest joints
  Pose pose_b(size_t i) const;  ///< the true answer, relative to B's rest joints
  Joints joints_a(size_t i) const;
  Joints joints_b(size_t i) const;
  Rotations rotations_b(size_t i) const;  ///< global, from the T-pose
  Points vertices_a(size_t i) const;      ///< in the order of source().rest.vertices
  Points vertices_b(size_t i) const;      ///< in the order of target().rest.vertices

 private:
  size_t frame(size_t i) const;

  const Body &a_, &b_;
  const Motion& motion_;
  EvalSequence sequence_;
  ScanConfig scan_;
  RngKey key_;
  SurfaceSampler surface_a_, surface_b_;
};

}  // namespace restage
