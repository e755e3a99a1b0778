#include "nn/metrics/metrics.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "autograd/base/error.h"
#include "autograd/base/parallel_each.h"
#include "nn/geometry/contact.h"

namespace restage::metrics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Value finite(double x) { return std::isfinite(x) ? Value(x) : std::nullopt; }

bool comparable(const Track& a, const Track& b) {
  return a.present() && b.present() && a.frames > 0 && a.points > 0;
}

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

Vector3d apply(const Similarity& map, const Vector3d& x) { return map.linear * x + map.shift; }

/// Plain sum, then a division: rounds as the reference does, which decides whether points that
/// coincide leave a spread of exactly 0 (undefined) or of one rounding error.
Vector3d centre(const double* points, int64_t count) {
  Vector3d sum = Vector3d::Zero();
  for (int64_t i = 0; i < count; ++i) sum += Eigen::Map<const Vector3d>(points + 3 * i);
  return sum / static_cast<double>(count);
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

Similarity procrustes(const double* source, const double* target, int64_t count, bool scale) {
  const Vector3d from = centre(source, count), to = centre(target, count);
  Matrix3d cross = Matrix3d::Zero();
  double spread = 0;
  for (int64_t i = 0; i < count; ++i) {
    const Vector3d x = Eigen::Map<const Vector3d>(source + 3 * i) - from;
    const Vector3d y = Eigen::Map<const Vector3d>(target + 3 * i) - to;
    cross += x * y.transpose();
    spread += x.squaredNorm();
  }
  if (!cross.allFinite()) return undefined();
  const Eigen::JacobiSVD<Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  const Vector3d flip(1, 1, sign);
  const Matrix3d rotation = svd.matrixV() * flip.asDiagonal() * svd.matrixU().transpose();
  const double s = scale ? svd.singularValues().dot(flip) / spread : 1.0;
  if (!std::isfinite(s)) return undefined();
  Similarity map;
  map.linear = s * rotation;
  map.shift = to - map.linear * from;
  return map;
}

std::vector<Similarity> align(const Track& pred, const Track& truth, const Alignment& how) {
  const auto frames = static_cast<size_t>(pred.frames);
  std::vector<Similarity> maps(frames);
  switch (how.mode) {
    case Alignment::Mode::none:
      break;
    case Alignment::Mode::root:
      for (size_t f = 0; f < frames; ++f) {
        const auto i = static_cast<int64_t>(f);
        maps[f].shift = truth.at(i, 0) - pred.at(i, 0);
      }
      break;
    case Alignment::Mode::sequence:
      maps.assign(frames, procrustes(pred.data, truth.data, pred.frames * pred.points, how.scale));
      break;
    case Alignment::Mode::frame:
      parallel_each(pred.frames, 1, [&](int64_t f) {
        maps[f] = procrustes(pred.slice(f, f + 1).data, truth.slice(f, f + 1).data, pred.points,
                             how.scale);
      });
      break;
  }
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
  return mean_over_frames(0, pred.frames, [&](int64_t f) {
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i)
      sum += (apply(maps[f], pred.at(f, i)) - truth.at(f, i)).norm();
    return sum / static_cast<double>(pred.points);
  });
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

Value edge_length_difference_mm(const Track& pred, const Track& truth, NeighbourFrame where) {
  if (!comparable(pred, truth) || pred.points <= kEdgeNeighbours) return std::nullopt;
  for (int64_t i = 0; i < 3 * truth.frames * truth.points; ++i)
    if (!std::isfinite(truth.data[i])) return std::nullopt;  // the search tree needs an order
  std::vector<int32_t> fixed;
  if (where == NeighbourFrame::first) fixed = nearest_neighbours(truth.data, truth.points);
  const auto mean = mean_over_frames(0, pred.frames, [&](int64_t f) {
    std::vector<int32_t> fresh;
    if (fixed.empty()) fresh = nearest_neighbours(truth.slice(f, f + 1).data, truth.points);
    const auto& near = fixed.empty() ? fresh : fixed;
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i)
      for (int k = 0; k < kEdgeNeighbours; ++k) {
        const int64_t j = near[i * kEdgeNeighbours + k];
        sum += std::abs((pred.at(f, i) - pred.at(f, j)).norm() -
                        (truth.at(f, i) - truth.at(f, j)).norm());
      }
    return sum / static_cast<double>(pred.points * kEdgeNeighbours);
  });
  return mean ? finite(1000 * *mean) : std::nullopt;
}

Value pmd(const Track& pred, const Track& truth) {
  if (!comparable(pred, truth)) return std::nullopt;
  return mean_over_frames(0, pred.frames, [&](int64_t f) {
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i) sum += (pred.at(f, i) - truth.at(f, i)).squaredNorm();
    return sum / static_cast<double>(pred.points);
  });
}

Value pmd_npt(const Track& pred, const Track& truth) {
  if (!comparable(pred, truth)) return std::nullopt;
  const auto box_centre = [](const Track& track, int64_t f) {
    Vector3d low = track.at(f, 0), high = low;
    for (int64_t i = 1; i < track.points; ++i) {
      low = low.cwiseMin(track.at(f, i));
      high = high.cwiseMax(track.at(f, i));
    }
    return Vector3d((low + high) / 2);
  };
  return mean_over_frames(0, pred.frames, [&](int64_t f) {
    const Vector3d a = box_centre(pred, f), b = box_centre(truth, f);
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i)
      sum += ((pred.at(f, i) - a) - (truth.at(f, i) - b)).squaredNorm();
    return sum / static_cast<double>(3 * pred.points);
  });
}

namespace {

/// The value that a share of the others is below.
Value percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::nullopt;
  const auto k = static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return finite(values[static_cast<size_t>(k)]);
}

double lowest_point(const Track& track, int64_t frame) {
  double out = std::numeric_limits<double>::infinity();
  for (int64_t i = 0; i < track.points; ++i) out = std::min(out, track.at(frame, i).y());
  return out;
}

}  // namespace

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

Value floor_penetration_mm(const Track& pred, const Track& truth) {
  if (!pred.present() || !truth.present()) return std::nullopt;
  double floor = std::numeric_limits<double>::infinity();
  for (int64_t t = 0; t < truth.frames; ++t) floor = std::min(floor, lowest_point(truth, t));
  std::vector<double> depths;
  for (int64_t t = 0; t < pred.frames; ++t)
    depths.push_back(1e3 * std::max(0.0, floor - lowest_point(pred, t)));
  return percentile(std::move(depths), 0.95);
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

/// Head, wrists and balls of the feet: no joint hangs on them.
constexpr std::array<int64_t, 5> kLeaves = {10, 11, 15, 20, 21};

/// The left joints of legs and arms.
constexpr std::array<std::array<size_t, 4>, 2> kLimbs = {{{1, 4, 7, 10}, {13, 16, 18, 20}}};
constexpr double kClearlySwapped = 0.05;  ///< metres a joint

}  // namespace

Value leaf_vertex_distance(const Track& pred, const Track& truth, const Track& joints) {
  if (!comparable(pred, truth) || joints.points != kJoints || joints.frames != truth.frames)
    return std::nullopt;
  std::vector<bool> chosen;
  for (int64_t i = 0; i < truth.points; ++i) {
    int64_t nearest = 0;
    for (int64_t j = 1; j < kJoints; ++j)
      if ((joints.at(0, j) - truth.at(0, i)).squaredNorm() <
          (joints.at(0, nearest) - truth.at(0, i)).squaredNorm())
        nearest = j;
    chosen.push_back(std::find(kLeaves.begin(), kLeaves.end(), nearest) != kLeaves.end());
  }
  const auto apart = distances(pred, truth, {Alignment::Mode::frame, true});
  double sum = 0, count = 0;
  for (size_t i = 0; i < apart.size(); ++i)
    if (chosen[i % chosen.size()]) sum += apart[i], count += 1;
  return finite(sum / count);
}

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
      here |= gained > kClearlySwapped * 2 * static_cast<double>(limb.size());
    }
    swapped += here ? 1 : 0;
  }
  return finite(swapped / static_cast<double>(truth.frames));
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
Value vertex_distance(const SequenceView& s) {
  return mean_distance(s.pred_vertices, s.true_vertices, {mode, scale});
}
template <Mode mode, bool scale = true>
Value joint_acceleration(const SequenceView& s) {
  return acceleration_error(s.pred_joints, s.true_joints, {mode, scale});
}
template <NeighbourFrame where>
Value edge_lengths(const SequenceView& s) {
  return edge_length_difference_mm(s.pred_vertices, s.true_vertices, where);
}
Value swaps(const SequenceView& s) { return side_swaps(s.pred_joints, s.true_joints); }
Value foot_slide(const SequenceView& s) { return foot_slide_mm(s.pred_joints, s.true_joints); }
Value peak_speed(const SequenceView& s) { return peak_speed_ratio(s.pred_joints, s.true_joints); }
Value floor_penetration(const SequenceView& s) {
  return floor_penetration_mm(s.pred_vertices, s.true_vertices);
}
Value leaves(const SequenceView& s) {
  return leaf_vertex_distance(s.pred_vertices, s.true_vertices, s.true_joints);
}
Value squared(const SequenceView& s) { return pmd(s.pred_vertices, s.true_vertices); }
Value squared_npt(const SequenceView& s) { return pmd_npt(s.pred_vertices, s.true_vertices); }

constexpr Metric kAll[] = {
    {"mpjpe", "MPJPE", "m", "mean joint distance", joint_distance<Mode::none>},
    {"pa_mpjpe", "PA-MPJPE", "m", "the same, every frame aligned with scale",
     joint_distance<Mode::frame>},
    {"acc", "Acc", "m/frame²", "mean difference of joint accelerations",
     joint_acceleration<Mode::none>},
    {"pa_acc", "PA-Acc", "m/frame²", "the same, every frame aligned with scale",
     joint_acceleration<Mode::frame>},
    {"mpvd", "MPVD", "m", "mean vertex distance", vertex_distance<Mode::none>},
    {"pa_mpvd", "PA-MPVD", "m", "the same, every frame aligned with scale",
     vertex_distance<Mode::frame>},
    {"medl", "MEDL", "mm", "mean difference of edge lengths, 6 nearest neighbours",
     edge_lengths<NeighbourFrame::every>},
    {"pmd", "PMD", "m²", "mean squared vertex distance", squared},
    {"pmd_npt", "PMD (NPT)", "m²", "mean squared coordinate difference, boxes centred",
     squared_npt},
    // further: kPapers of them are above
    {"leaf_pa_mpvd", "PA-MPVD, leaves", "m",
     "of the vertices nearest to head, wrists and feet, every frame aligned as a whole", leaves},
    {"side_swaps", "sides swapped", "of frames", "legs or arms nearer with left for right", swaps},
    {"foot_slide_mm", "foot slide", "mm/frame", "feet that truly stand, median", foot_slide},
    {"floor_penetration_mm", "below the floor", "mm", "lowest vertex, 95th percentile",
     floor_penetration},
    {"peak_speed", "peak speed", "of the truth's", "99th percentile of each joint's speed",
     peak_speed},
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
    {"pa_mpvd_rigid", "PA-MPVD, rigid", "m", "every frame aligned without scale",
     vertex_distance<Mode::frame, false>},
    {"pa_mpvd_sequence", "PA-MPVD, sequence", "m", "one alignment of the sequence, with scale",
     vertex_distance<Mode::sequence>},
    {"medl_first", "MEDL, first frame", "mm", "neighbours found in the first true frame only",
     edge_lengths<NeighbourFrame::first>},
};

constexpr size_t kPapers = 9, kRecorded = 14;
static_assert(std::string_view(kAll[kPapers].name) == "leaf_pa_mpvd" &&
              std::string_view(kAll[kRecorded].name) == "mpjpe_root");

void check_pair(const Track& pred, const Track& truth, const char* what, size_t sequence) {
  if (!pred.present() || !truth.present()) return;
  if (pred.frames == truth.frames && pred.points == truth.points) return;
  throw WorkError("evaluate: sequence " + std::to_string(sequence) +
                  ": prediction and truth have " + std::to_string(pred.frames) + " x " +
                  std::to_string(pred.points) + " and " + std::to_string(truth.frames) + " x " +
                  std::to_string(truth.points) + " " + what);
}

}  // namespace

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
    Values& values = out.sequences.emplace_back();
    for (const Metric& metric : metrics) values.push_back(metric.compute(s));
  }
  average(&out);
  if (sequences.empty()) out.mean.assign(metrics.size(), std::nullopt);
  return out;
}

}  // namespace restage::metrics
