// Metrics of retargeting (spec of the method, section 8) on plain float64 values, metres, no tape.
// A metric that cannot be computed (no vertices, too few frames or points, a collapsed prediction
// that Procrustes cannot scale, values that are not finite) is std::nullopt, never 0.
// To add one of joints or rotations: write a function of a SequenceView and give it a line in
// table() (metrics.cpp). One of surfaces is a SurfaceMeter (surfaces.h): surfaces may be too large
// to be held, so they come some frames at a time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace restage::metrics {

/// Points over time, [frames, points, 3], row-major, metres. Does not own its memory.
struct Track {
  const double* data = nullptr;
  int64_t frames = 0;
  int64_t points = 0;

  bool present() const { return data != nullptr; }
  Eigen::Map<const Eigen::Vector3d> at(int64_t frame, int64_t point) const {
    return Eigen::Map<const Eigen::Vector3d>(data + 3 * (frame * points + point));
  }
  /// Frames [begin, end) of this track; absent stays absent.
  Track slice(int64_t begin, int64_t end) const;
};

/// A track in memory, or one that is read some frames at a time.
class Surfaces {
 public:
  /// Fills `out` with the values of frames [first, first + count), row-major.
  using Read = std::function<void(int64_t first, int64_t count, std::vector<double>& out)>;

  Surfaces() = default;  ///< absent
  Surfaces(const Track& held)
      : frames_(held.frames), points_(held.points), held_(held), present_(held.present()) {}
  Surfaces(int64_t frames, int64_t points, Read read)
      : frames_(frames), points_(points), read_(std::move(read)), present_(true) {}

  bool present() const { return present_; }
  int64_t frames() const { return frames_; }
  int64_t points() const { return points_; }
  /// Frames [begin, end) of this track; absent stays absent.
  Surfaces slice(int64_t begin, int64_t end) const;
  /// Frames [first, first + count). What is read lies in `memory`, which has to live on.
  Track block(int64_t first, int64_t count, std::vector<double>& memory) const;

 private:
  int64_t first_ = 0, frames_ = 0, points_ = 0;
  Track held_;
  Read read_;
  bool present_ = false;
};

/// One sequence: prediction beside ground truth. Either kind of points may be absent.
struct SequenceView {
  Track pred_joints, true_joints;
  Surfaces pred_vertices, true_vertices;
  int64_t frames = 0;
  /// Of the world, from the T-pose: frames x 22 unit quaternions w x y z. Empty if absent.
  std::span<const double> pred_rotations = {}, true_rotations = {};
};

// ---- the definitions; each takes two tracks of equal shape -------------------------------------

/// How a prediction is moved onto the ground truth before it is measured.
struct Alignment {
  enum class Mode {
    none,
    frame,     ///< one Procrustes map per frame (the papers' PA)
    sequence,  ///< one Procrustes map for all frames
    root,      ///< point 0 of every frame moved onto its true place
  };
  Mode mode = Mode::none;
  bool scale = true;  ///< false: rigid
};

/// x -> linear * x + shift.
struct Similarity {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// Best similarity (or rigid) map of `count` points [count, 3] onto others, reflections excluded.
/// Not finite if all source points coincide (there is no scale) or a value is not finite.
Similarity procrustes(const double* source, const double* target, int64_t count, bool scale);
/// The map of every frame, as `how` says.
std::vector<Similarity> align(const Track& pred, const Track& truth, const Alignment& how);

using Value = std::optional<double>;

/// Mean distance (MPJPE on joints, MPVD on vertices; PA-... with an alignment), metres.
Value mean_distance(const Track& pred, const Track& truth, const Alignment& how = {});
/// Distance of every point of every frame [frames x points], metres. Empty if no frames.
std::vector<double> distances(const Track& pred, const Track& truth, const Alignment& how = {});
/// Mean distance of every point over the frames, metres (per-joint errors). Empty if no frames.
std::vector<double> mean_distance_by_point(const Track& pred, const Track& truth,
                                           const Alignment& how = {});
/// Share of the true points that lie within `radius` (frames x points, metres) of the predicted
/// ones: to check regions that are said to hold nine points in ten.
Value share_within(const Track& pred, const Track& truth, std::span<const double> radius);
/// Mean difference of second differences, metres per frame squared; needs 3 frames.
Value acceleration_error(const Track& pred, const Track& truth, const Alignment& how = {});

/// Where MEDL (surfaces.h) looks for neighbours: anew in every true frame, or in the first.
enum class NeighbourFrame { every, first };
inline constexpr int kEdgeNeighbours = 6;
/// The 6 nearest other points of every point, [count, 6], nearest first, ties to the lower index.
/// `count` must be at least 7.
std::vector<int32_t> nearest_neighbours(const double* points, int64_t count);

/// How far feet that truly stand (standing_feet()) move from one frame to the next, median,
/// millimetres; needs the 22 joints.
Value foot_slide_mm(const Track& pred, const Track& truth);
/// How far the lowest point is below the lowest of all true frames, 95th percentile of the frames,
/// millimetres.
Value floor_penetration_mm(const Track& pred, const Track& truth);

/// Whether sharp motions stay sharp: over the points, the sum of each one's fastest speed (99th
/// percentile of the frames) in the prediction by that of the truth. Empty if nothing moves.
Value peak_speed_ratio(const Track& pred, const Track& truth);

/// PA-MPVD of the vertices that are nearest to head, wrists or feet in the first true frame: joints
/// whose rotation moves no other joint, so that the surface alone shows it. Metres; needs the 22
/// joints.
Value leaf_vertex_distance(const Track& pred, const Track& truth, const Track& joints);

/// Part of the frames in which the legs or the arms of the prediction would be nearer to the truth
/// with left and right exchanged, by 5 cm a joint at least; needs the 22 joints.
Value side_swaps(const Track& pred, const Track& truth);

/// Differences of rotations of the 22 joints: the angle of the turn between both, in degrees.
struct RotationError {
  std::array<double, 22> by_joint{};  ///< means over the frames
  double mean = 0;                    ///< over all
  double over_90 = 0;                 ///< share of frames and joints that are more than 90 off
};
/// Quaternions w x y z, frames x 22 x 4 values each. Empty if the numbers differ or there are none.
std::optional<RotationError> rotation_error(std::span<const double> pred,
                                            std::span<const double> truth);

/// What is gained by answering only the surest frames: their share of all, and their mean error.
struct RiskAtCoverage {
  double coverage = 0, risk = 0;
};
/// At coverages from 1 down to 0.5; of equally sure frames the earlier ones. Empty without frames.
std::vector<RiskAtCoverage> risk_coverage(std::span<const double> confidence,
                                          std::span<const double> errors);

// ---- the table ---------------------------------------------------------------------------------

class SurfaceMeter;

/// Of joints, of surfaces or of rotations; one that is none of these has no value.
struct Metric {
  const char* name;   ///< key in JSON
  const char* title;  ///< heading in tables
  const char* unit;
  const char* help;
  Value (*of_joints)(const SequenceView&) = nullptr;
  /// For one sequence, of whose view it may take the joints.
  std::unique_ptr<SurfaceMeter> (*of_surfaces)(const SequenceView&) = nullptr;
  Value (*of_rotations)(const SequenceView&) = nullptr;
  Value compute(const SequenceView& sequence) const;
};

/// The papers' metrics: those of `restage eval`, in the order of its tables.
std::span<const Metric> table();
/// Those that the result of a trial holds: the papers', then leaves, sides, contact, speed, turns.
std::span<const Metric> recorded();
/// All that are not in table(), for `--variants`: those of recorded(), then further
/// alignments (rigid, one map per sequence, root).
std::span<const Metric> variants();

/// Values beside the metrics of a table, in its order.
using Values = std::vector<Value>;
struct Evaluation {
  std::vector<Values> sequences;
  Values mean;  ///< over the sequences that have a value, equal weight each
};

/// Fills `mean` from `sequences`.
void average(Evaluation* evaluation);

/// Computes all metrics of a table for every sequence. Surfaces go by once for all metrics, as
/// often as the one that looks most often wants it, in memory that does not grow with their frames.
/// Same bits for any number of threads, and whether surfaces are in memory or read. Throws
/// WorkError if prediction and truth of a sequence differ in shape.
Evaluation evaluate(std::span<const SequenceView> sequences,
                    std::span<const Metric> metrics = table());

}  // namespace restage::metrics
