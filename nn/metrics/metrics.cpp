#include "nn/metrics/metrics.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "autograd/base/error.h"
#include "autograd/base/parallel_each.h"
#include "nn/geometry/contact.h"
#include "nn/metrics/alignment.h"
#include "nn/metrics/surfaces.h"

namespace restage::metrics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Mean of `of_frame` over frames [first, last): frames in parallel, added up in their order.
Value mean_over_frames(int64_t first, int64_t last,
                       const std::function<double(int64_t)>& of_frame) {
  const int64_t n = last - first;
  if (n <= 0) return std::nullopt;
  std::vector<double> each(static_cast<size_t>(n));
  parallel_each(n, 1, [&](int64_t i) { each[i] = of_frame(first + i); });
  double total = 0;
  for (const double x : each) total += x;
  return finite(total / static_cast<double>(n));
}

void add_points(const double* points, int64_t count, Vector3d& sum) {
  for (int64_t i = 0; i < count; ++i) sum += Eigen::Map<const Vector3d>(points + 3 * i);
}

Similarity undefined() {
  Similarity map;
  map.linear.setConstant(std::numeric_limits<double>::quiet_NaN());
  return map;
}

}  // namespace

Track Track::slice(int64_t begin, int64_t end) const {
  if (!present()) return *this;
  return {data + 3 * points * begin, end - begin, points};
}

void Procrustes::add_to_middles(const double* source, const double* target, int64_t count) {
  add_points(source, count, from_);
  add_points(target, count, to_);
  count_ += count;
}

/// Plain sum, then a division: rounds as the reference does, which decides whether points that
/// coincide leave a spread of exactly 0 (undefined) or of one rounding error.
void Procrustes::end_middles() {
  from_ = (from_ / static_cast<double>(count_)).eval();
  to_ = (to_ / static_cast<double>(count_)).eval();
}

void Procrustes::add_to_map(const double* source, const double* target, int64_t count) {
  for (int64_t i = 0; i < count; ++i) {
    const Vector3d x = Eigen::Map<const Vector3d>(source + 3 * i) - from_;
    const Vector3d y = Eigen::Map<const Vector3d>(target + 3 * i) - to_;
    cross_ += x * y.transpose();
    spread_ += x.squaredNorm();
  }
}

Similarity Procrustes::map(bool scale) const {
  if (!cross_.allFinite()) return undefined();
  const Eigen::JacobiSVD<Matrix3d> svd(cross_, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  const Vector3d flip(1, 1, sign);
  const Matrix3d rotation = svd.matrixV() * flip.asDiagonal() * svd.matrixU().transpose();
  const double s = scale ? svd.singularValues().dot(flip) / spread_ : 1.0;
  if (!std::isfinite(s)) return undefined();
  Similarity map;
  map.linear = s * rotation;
  map.shift = to_ - map.linear * from_;
  return map;
}

Similarity procrustes(const double* source, const double* target, int64_t count, bool scale) {
  Procrustes out;
  out.add_to_middles(source, target, count);
  out.end_middles();
  out.add_to_map(source, target, count);
  return out.map(scale);
}

Similarity align_frame(const Track& pred, const Track& truth, int64_t f, const Alignment& how) {
  if (how.mode == Alignment::Mode::frame)
    return procrustes(pred.slice(f, f + 1).data, truth.slice(f, f + 1).data, pred.points,
                      how.scale);
  Similarity map;
  if (how.mode == Alignment::Mode::root) map.shift = truth.at(f, 0) - pred.at(f, 0);
  return map;
}

double frame_distance(const Track& pred, const Track& truth, int64_t f, const Similarity& map) {
  double sum = 0;
  for (int64_t i = 0; i < pred.points; ++i)
    sum += (apply(map, pred.at(f, i)) - truth.at(f, i)).norm();
  return sum / static_cast<double>(pred.points);
}

std::vector<Similarity> align(const Track& pred, const Track& truth, const Alignment& how) {
  std::vector<Similarity> maps(static_cast<size_t>(pred.frames));
  if (how.mode == Alignment::Mode::sequence)
    maps.assign(maps.size(),
                procrustes(pred.data, truth.data, pred.frames * pred.points, how.scale));
  else
    parallel_each(pred.frames, 1, [&](int64_t f) { maps[f] = align_frame(pred, truth, f, how); });
  return maps;
}

Value share_within(const Track& pred, const Track& truth, std::span<const double> radius) {
  const int64_t n = pred.frames * pred.points;
  int64_t within = 0;
  for (int64_t i = 0; i < n; ++i)
    within += (pred.at(0, i) - truth.at(0, i)).norm() <= radius[static_cast<size_t>(i)];
  if (n == 0) return std::nullopt;
  return static_cast<double>(within) / static_cast<double>(n);
}

Value mean_distance(const Track& pred, const Track& truth, const Alignment& how) {
  if (!comparable(pred, truth)) return std::nullopt;
  const auto maps = align(pred, truth, how);
  return mean_over_frames(0, pred.frames,
                          [&](int64_t f) { return frame_distance(pred, truth, f, maps[f]); });
}

std::vector<double> distances(const Track& pred, const Track& truth, const Alignment& how) {
  if (!comparable(pred, truth)) return {};
  const auto maps = align(pred, truth, how);
  std::vector<double> out;
  for (int64_t f = 0; f < pred.frames; ++f)
    for (int64_t i = 0; i < pred.points; ++i)
      out.push_back((apply(maps[f], pred.at(f, i)) - truth.at(f, i)).norm());
  return out;
}

std::vector<double> mean_distance_by_point(const Track& pred, const Track& truth,
                                           const Alignment& how) {
  const std::vector<double> all = distances(pred, truth, how);
  std::vector<double> mean(all.empty() ? 0 : static_cast<size_t>(pred.points), 0.0);
  for (size_t k = 0; k < all.size(); ++k) mean[k % mean.size()] += all[k];
  for (double& value : mean) value /= static_cast<double>(pred.frames);
  return mean;
}

Value acceleration_error(const Track& pred, const Track& truth, const Alignment& how) {
  if (!comparable(pred, truth) || pred.frames < 3) return std::nullopt;
  const auto maps = align(pred, truth, how);
  const auto moved = [&](int64_t f, int64_t i) { return apply(maps[f], pred.at(f, i)); };
  return mean_over_frames(1, pred.frames - 1, [&](int64_t f) {
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i) {
      const Vector3d a = moved(f + 1, i) - 2 * moved(f, i) + moved(f - 1, i);
      const Vector3d b = truth.at(f + 1, i) - 2 * truth.at(f, i) + truth.at(f - 1, i);
      sum += (a - b).norm();
    }
    return sum / static_cast<double>(pred.points);
  });
}

Value foot_slide_mm(const Track& pred, const Track& truth) {
  if (!pred.present() || !truth.present() || truth.points != kJoints) return std::nullopt;
  std::vector<Joints> performance(static_cast<size_t>(truth.frames));
  for (int64_t t = 0; t < truth.frames; ++t)
    for (int64_t j = 0; j < kJoints; ++j)
      performance[static_cast<size_t>(t)][static_cast<size_t>(j)] = truth.at(t, j);
  const auto standing = standing_feet(performance);
  std::vector<double> slides;
  for (int64_t t = 1; t < truth.frames; ++t)
    for (size_t side = 0; side < kFeet.size(); ++side) {
      const auto now = static_cast<size_t>(t);
      if (standing[now][side] && standing[now - 1][side])
        slides.push_back(1e3 * (pred.at(t, kFeet[side]) - pred.at(t - 1, kFeet[side])).norm());
    }
  return percentile(std::move(slides), 0.5);
}

Value peak_speed_ratio(const Track& pred, const Track& truth) {
  if (!comparable(pred, truth) || truth.frames < 2) return std::nullopt;
  const auto peaks = [](const Track& track) {
    double sum = 0;
    for (int64_t i = 0; i < track.points; ++i) {
      std::vector<double> speeds;
      for (int64_t t = 1; t < track.frames; ++t)
        speeds.push_back((track.at(t, i) - track.at(t - 1, i)).norm());
      sum += percentile(std::move(speeds), 0.99).value_or(std::nan(""));
    }
    return sum;
  };
  return finite(peaks(pred) / peaks(truth));
}

namespace {

/// The left joints of legs and arms.
constexpr std::array<std::array<size_t, 4>, 2> kLimbs = {{{1, 4, 7, 10}, {13, 16, 18, 20}}};
constexpr double kClearlySwapped = 0.05;  ///< metres a joint

}  // namespace

Value side_swaps(const Track& pred, const Track& truth) {
  if (!comparable(pred, truth) || truth.points != kJoints) return std::nullopt;
  double swapped = 0;
  for (int64_t t = 0; t < truth.frames; ++t) {
    bool here = false;
    for (const auto& limb : kLimbs) {
      double gained = 0;
      for (const size_t joint : limb) {
        const auto left = static_cast<int64_t>(joint);
        const int64_t right = kMirror[joint];
        for (const auto& [j, other] : {std::pair{left, right}, std::pair{right, left}})
          gained +=
              (pred.at(t, j) - truth.at(t, j)).norm() - (pred.at(t, other) - truth.at(t, j)).norm();
      }
      if (!std::isfinite(gained)) return std::nullopt;
      here |= gained > kClearlySwapped * 2 * static_cast<double>(limb.size());
    }
    swapped += here ? 1 : 0;
  }
  return finite(swapped / static_cast<double>(truth.frames));
}

std::optional<RotationError> rotation_error(std::span<const double> pred,
                                            std::span<const double> truth) {
  if (pred.empty() || pred.size() != truth.size() || pred.size() % (4 * kJoints) != 0)
    return std::nullopt;
  RotationError out;
  const double share = 4.0 * kJoints / static_cast<double>(pred.size());  // of a frame
  for (size_t i = 0; i < pred.size(); i += 4) {
    const Eigen::Map<const Eigen::Vector4d> a(&pred[i]), b(&truth[i]);
    const double cosine = std::abs(a.dot(b)) / (a.norm() * b.norm());
    const double angle = 2 * std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi;
    out.by_joint[i / 4 % kJoints] += share * angle;
    out.mean += share / kJoints * angle;
    out.over_90 += angle > 90 ? share / kJoints : 0;
  }
  return out;
}

std::vector<RiskAtCoverage> risk_coverage(std::span<const double> confidence,
                                          std::span<const double> errors) {
  std::vector<size_t> order(std::min(confidence.size(), errors.size()));
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return confidence[a] > confidence[b]; });
  std::vector<RiskAtCoverage> out;
  for (const double coverage : {1.0, 0.95, 0.9, 0.8, 0.7, 0.5}) {
    const auto n = static_cast<size_t>(std::llround(coverage * static_cast<double>(order.size())));
    if (n == 0) continue;
    double sum = 0;
    for (size_t i = 0; i < n; ++i) sum += errors[order[i]];
    out.push_back({coverage, sum / static_cast<double>(n)});
  }
  return out;
}

// ---- the table ---------------------------------------------------------------------------------

namespace {

using Mode = Alignment::Mode;

template <Mode mode, bool scale = true>
Value joint_distance(const SequenceView& s) {
  return mean_distance(s.pred_joints, s.true_joints, {mode, scale});
}
template <Mode mode, bool scale = true>
Value joint_acceleration(const SequenceView& s) {
  return acceleration_error(s.pred_joints, s.true_joints, {mode, scale});
}
Value swaps(const SequenceView& s) { return side_swaps(s.pred_joints, s.true_joints); }
Value foot_slide(const SequenceView& s) { return foot_slide_mm(s.pred_joints, s.true_joints); }
Value peak_speed(const SequenceView& s) { return peak_speed_ratio(s.pred_joints, s.true_joints); }

Value rotation(const SequenceView& s) {
  const auto error = rotation_error(s.pred_rotations, s.true_rotations);
  return error ? finite(error->mean) : std::nullopt;
}
Value rotation_over_90(const SequenceView& s) {
  const auto error = rotation_error(s.pred_rotations, s.true_rotations);
  return error ? finite(error->over_90) : std::nullopt;
}

using Meter = std::unique_ptr<SurfaceMeter>;
template <Mode mode, bool scale = true>
Meter vertex_distance(const SequenceView&) {
  return distance_meter({mode, scale});
}
template <NeighbourFrame where>
Meter edge_lengths(const SequenceView&) {
  return edge_meter(where);
}
Meter floor_penetration(const SequenceView&) { return floor_meter(); }
Meter leaves(const SequenceView& s) {
  return s.true_joints.frames == s.true_vertices.frames() ? leaf_meter(s.true_joints) : nullptr;
}
Meter squared(const SequenceView&) { return squared_meter(); }
Meter squared_npt(const SequenceView&) { return squared_npt_meter(); }

constexpr Metric kAll[] = {
    {"mpjpe", "MPJPE", "m", "mean joint distance", joint_distance<Mode::none>},
    {"pa_mpjpe", "PA-MPJPE", "m", "the same, every frame aligned with scale",
     joint_distance<Mode::frame>},
    {"acc", "Acc", "m/frame²", "mean difference of joint accelerations",
     joint_acceleration<Mode::none>},
    {"pa_acc", "PA-Acc", "m/frame²", "the same, every frame aligned with scale",
     joint_acceleration<Mode::frame>},
    {"mpvd", "MPVD", "m", "mean vertex distance", nullptr, vertex_distance<Mode::none>},
    {"pa_mpvd", "PA-MPVD", "m", "the same, every frame aligned with scale", nullptr,
     vertex_distance<Mode::frame>},
    {"medl", "MEDL", "mm", "mean difference of edge lengths, 6 nearest neighbours", nullptr,
     edge_lengths<NeighbourFrame::every>},
    {"pmd", "PMD", "m²", "mean squared vertex distance", nullptr, squared},
    {"pmd_npt", "PMD (NPT)", "m²", "mean squared coordinate difference, boxes centred", nullptr,
     squared_npt},
    // further: kPapers of them are above
    {"leaf_pa_mpvd", "PA-MPVD, leaves", "m",
     "of the vertices nearest to head, wrists and feet, every frame aligned as a whole", nullptr,
     leaves},
    {"side_swaps", "sides swapped", "of frames", "legs or arms nearer with left for right", swaps},
    {"foot_slide_mm", "foot slide", "mm/frame", "feet that truly stand, median", foot_slide},
    {"floor_penetration_mm", "below the floor", "mm", "lowest vertex, 95th percentile", nullptr,
     floor_penetration},
    {"peak_speed", "peak speed", "of the truth's", "99th percentile of each joint's speed",
     peak_speed},
    {"rotation_deg", "rotation", "degrees", "mean angle between true and found world rotations",
     nullptr, nullptr, rotation},
    {"rotation_over_90", "rotations over 90°", "of joints", "rotations more than 90 degrees off",
     nullptr, nullptr, rotation_over_90},
    // variants: kRecorded of them are above
    {"mpjpe_root", "MPJPE, root", "m", "pelvis moved onto its true place in every frame",
     joint_distance<Mode::root>},
    {"pa_mpjpe_rigid", "PA-MPJPE, rigid", "m", "every frame aligned without scale",
     joint_distance<Mode::frame, false>},
    {"pa_mpjpe_sequence", "PA-MPJPE, sequence", "m", "one alignment of the sequence, with scale",
     joint_distance<Mode::sequence>},
    {"pa_mpjpe_sequence_rigid", "PA-MPJPE, sequence, rigid", "m",
     "one alignment of the sequence, without scale", joint_distance<Mode::sequence, false>},
    {"pa_acc_rigid", "PA-Acc, rigid", "m/frame²", "every frame aligned without scale",
     joint_acceleration<Mode::frame, false>},
    {"pa_acc_sequence", "PA-Acc, sequence", "m/frame²", "one alignment of the sequence, with scale",
     joint_acceleration<Mode::sequence>},
    {"pa_mpvd_rigid", "PA-MPVD, rigid", "m", "every frame aligned without scale", nullptr,
     vertex_distance<Mode::frame, false>},
    {"pa_mpvd_sequence", "PA-MPVD, sequence", "m", "one alignment of the sequence, with scale",
     nullptr, vertex_distance<Mode::sequence>},
    {"medl_first", "MEDL, first frame", "mm", "neighbours found in the first true frame only",
     nullptr, edge_lengths<NeighbourFrame::first>},
};

constexpr size_t kPapers = 9, kRecorded = 16;
static_assert(std::string_view(kAll[kPapers].name) == "leaf_pa_mpvd" &&
              std::string_view(kAll[kRecorded].name) == "mpjpe_root");

void check_pair(const Surfaces& pred, const Surfaces& truth, const char* what, size_t sequence) {
  if (!pred.present() || !truth.present()) return;
  if (pred.frames() == truth.frames() && pred.points() == truth.points()) return;
  throw WorkError("evaluate: sequence " + std::to_string(sequence) +
                  ": prediction and truth have " + std::to_string(pred.frames()) + " x " +
                  std::to_string(pred.points()) + " and " + std::to_string(truth.frames()) + " x " +
                  std::to_string(truth.points()) + " " + what);
}

Values values_of(const SequenceView& s, std::span<const Metric> metrics) {
  const Surfaces &pred = s.pred_vertices, &truth = s.true_vertices;
  const bool surfaces =
      pred.present() && truth.present() && truth.frames() > 0 && truth.points() > 0;
  std::vector<Meter> meters(metrics.size());
  for (size_t m = 0; m < metrics.size(); ++m)
    if (surfaces && metrics[m].of_surfaces) meters[m] = metrics[m].of_surfaces(s);
  measure(pred, truth, meters);
  Values out(metrics.size());
  for (size_t m = 0; m < metrics.size(); ++m) {
    if (meters[m]) out[m] = meters[m]->value();
    if (metrics[m].of_joints) out[m] = metrics[m].of_joints(s);
    if (metrics[m].of_rotations) out[m] = metrics[m].of_rotations(s);
  }
  return out;
}

}  // namespace

Value Metric::compute(const SequenceView& sequence) const {
  return values_of(sequence, {this, 1})[0];
}

std::span<const Metric> table() { return std::span(kAll).first(kPapers); }
std::span<const Metric> recorded() { return std::span(kAll).first(kRecorded); }
std::span<const Metric> variants() { return std::span(kAll).subspan(kPapers); }

void average(Evaluation* evaluation) {
  evaluation->mean.clear();
  const size_t columns =
      evaluation->sequences.empty() ? table().size() : evaluation->sequences[0].size();
  for (size_t m = 0; m < columns; ++m) {
    double sum = 0;
    int count = 0;
    for (const Values& values : evaluation->sequences)
      if (values[m]) {
        sum += *values[m];
        ++count;
      }
    evaluation->mean.push_back(count > 0 ? finite(sum / count) : std::nullopt);
  }
}

Evaluation evaluate(std::span<const SequenceView> sequences, std::span<const Metric> metrics) {
  Evaluation out;
  for (const SequenceView& s : sequences) {
    check_pair(s.pred_joints, s.true_joints, "joints", out.sequences.size());
    check_pair(s.pred_vertices, s.true_vertices, "vertices", out.sequences.size());
    out.sequences.push_back(values_of(s, metrics));
  }
  average(&out);
  if (sequences.empty()) out.mean.assign(metrics.size(), std::nullopt);
  return out;
}

}  // namespace restage::metrics
