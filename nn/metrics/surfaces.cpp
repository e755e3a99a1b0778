#include "nn/metrics/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "autograd/base/parallel_each.h"
#include "nn/geometry/skeleton.h"
#include "nn/metrics/alignment.h"

namespace restage::metrics {
namespace {

using Eigen::Vector3d;
using Mode = Alignment::Mode;

constexpr int64_t kBlockBytes = int64_t{16} << 20;  // that are read of a track at a time

/// Mean over the frames of what is measured in each: frames in parallel, added up in their order.
class FrameMean : public SurfaceMeter {
 public:
  void add(const Track& pred, const Track& truth) override {
    std::vector<double> each(static_cast<size_t>(pred.frames));
    parallel_each(pred.frames, 1, [&](int64_t f) { each[f] = of_frame(pred, truth, f); });
    for (const double x : each) total_ += x;
    frames_ += pred.frames;
  }
  Value value() const override {
    return frames_ > 0 ? finite(total_ / static_cast<double>(frames_)) : std::nullopt;
  }

 private:
  virtual double of_frame(const Track& pred, const Track& truth, int64_t frame) const = 0;

  double total_ = 0;
  int64_t frames_ = 0;
};

class Distance final : public FrameMean {
 public:
  explicit Distance(const Alignment& how) : how_(how) {}

 private:
  double of_frame(const Track& pred, const Track& truth, int64_t f) const override {
    return frame_distance(pred, truth, f, align_frame(pred, truth, f, how_));
  }
  Alignment how_;
};

/// With one map for all frames, which two looks at them find.
class AlignedDistance final : public FrameMean {
 public:
  explicit AlignedDistance(bool scale) : scale_(scale) {}
  void add(const Track& pred, const Track& truth) override {
    const int64_t n = pred.frames * pred.points;
    if (look_ == 0) procrustes_.add_to_middles(pred.data, truth.data, n);
    if (look_ == 1) procrustes_.add_to_map(pred.data, truth.data, n);
    if (look_ == 2) FrameMean::add(pred, truth);
  }
  bool again() override {
    if (look_ == 0) procrustes_.end_middles();
    if (look_ == 1) map_ = procrustes_.map(scale_);
    return ++look_ < 3;
  }

 private:
  double of_frame(const Track& pred, const Track& truth, int64_t f) const override {
    return frame_distance(pred, truth, f, map_);
  }
  bool scale_;
  int look_ = 0;
  Procrustes procrustes_;
  Similarity map_;
};

class Edges final : public FrameMean {
 public:
  explicit Edges(NeighbourFrame where) : where_(where) {}
  void add(const Track& pred, const Track& truth) override {
    const auto end = truth.data + 3 * truth.frames * truth.points;
    finite_ = finite_ && pred.points > kEdgeNeighbours &&
              std::all_of(truth.data, end, [](double x) { return std::isfinite(x); });
    if (!finite_) return;  // the search tree needs an order
    if (where_ == NeighbourFrame::first && fixed_.empty())
      fixed_ = nearest_neighbours(truth.data, truth.points);
    FrameMean::add(pred, truth);
  }
  Value value() const override {
    const Value mean = finite_ ? FrameMean::value() : std::nullopt;
    return mean ? finite(1000 * *mean) : std::nullopt;
  }

 private:
  double of_frame(const Track& pred, const Track& truth, int64_t f) const override {
    std::vector<int32_t> fresh;
    if (fixed_.empty()) fresh = nearest_neighbours(truth.slice(f, f + 1).data, truth.points);
    const auto& near = fixed_.empty() ? fresh : fixed_;
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i)
      for (int k = 0; k < kEdgeNeighbours; ++k) {
        const int64_t j = near[i * kEdgeNeighbours + k];
        sum += std::abs((pred.at(f, i) - pred.at(f, j)).norm() -
                        (truth.at(f, i) - truth.at(f, j)).norm());
      }
    return sum / static_cast<double>(pred.points * kEdgeNeighbours);
  }
  NeighbourFrame where_;
  bool finite_ = true;
  std::vector<int32_t> fixed_;
};

class Squared final : public FrameMean {
  double of_frame(const Track& pred, const Track& truth, int64_t f) const override {
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i) sum += (pred.at(f, i) - truth.at(f, i)).squaredNorm();
    return sum / static_cast<double>(pred.points);
  }
};

class SquaredNpt final : public FrameMean {
  static Vector3d box_centre(const Track& track, int64_t f) {
    Vector3d low = track.at(f, 0), high = low;
    for (int64_t i = 1; i < track.points; ++i) {
      low = low.cwiseMin(track.at(f, i));
      high = high.cwiseMax(track.at(f, i));
    }
    return (low + high) / 2;
  }
  double of_frame(const Track& pred, const Track& truth, int64_t f) const override {
    const Vector3d a = box_centre(pred, f), b = box_centre(truth, f);
    double sum = 0;
    for (int64_t i = 0; i < pred.points; ++i)
      sum += ((pred.at(f, i) - a) - (truth.at(f, i) - b)).squaredNorm();
    return sum / static_cast<double>(3 * pred.points);
  }
};

class Floor final : public SurfaceMeter {
 public:
  void add(const Track& pred, const Track& truth) override {
    for (int64_t f = 0; f < truth.frames; ++f) {
      floor_ = lower(floor_, lowest_point(truth, f));
      lowest_.push_back(lowest_point(pred, f));
    }
  }
  Value value() const override {
    std::vector<double> depths;
    for (const double low : lowest_) depths.push_back(low > floor_ ? 0 : 1e3 * (floor_ - low));
    return percentile(std::move(depths), 0.95);
  }

 private:
  static double lowest_point(const Track& track, int64_t frame) {
    double out = std::numeric_limits<double>::infinity();
    for (int64_t i = 0; i < track.points; ++i) out = lower(out, track.at(frame, i).y());
    return out;
  }
  /// What is not a number stays so.
  static double lower(double a, double b) { return b < a || std::isnan(b) ? b : a; }
  double floor_ = std::numeric_limits<double>::infinity();
  std::vector<double> lowest_;  // of every predicted frame
};

/// Head, wrists and balls of the feet: no joint hangs on them.
constexpr std::array<int64_t, 5> kLeaves = {10, 11, 15, 20, 21};

class Leaves final : public SurfaceMeter {
 public:
  explicit Leaves(const Track& joints) : joints_(joints) {}
  void add(const Track& pred, const Track& truth) override {
    if (chosen_.empty()) choose(truth);
    const auto apart = distances(pred, truth, {Mode::frame, true});
    for (size_t i = 0; i < apart.size(); ++i)
      if (chosen_[i % chosen_.size()]) sum_ += apart[i], count_ += 1;
  }
  Value value() const override { return finite(sum_ / count_); }

 private:
  void choose(const Track& truth) {
    for (int64_t i = 0; i < truth.points; ++i) {
      int64_t nearest = 0;
      for (int64_t j = 1; j < kJoints; ++j)
        if ((joints_.at(0, j) - truth.at(0, i)).squaredNorm() <
            (joints_.at(0, nearest) - truth.at(0, i)).squaredNorm())
          nearest = j;
      chosen_.push_back(std::find(kLeaves.begin(), kLeaves.end(), nearest) != kLeaves.end());
    }
  }
  Track joints_;
  std::vector<bool> chosen_;
  double sum_ = 0, count_ = 0;
};

Value measured(std::unique_ptr<SurfaceMeter> meter, const Track& pred, const Track& truth) {
  if (meter == nullptr || !comparable(pred, truth)) return std::nullopt;
  measure(pred, truth, {&meter, 1});
  return meter->value();
}

}  // namespace

Surfaces Surfaces::slice(int64_t begin, int64_t end) const {
  Surfaces out = *this;
  if (!present_) return out;
  out.frames_ = end - begin;
  out.first_ = first_ + begin;
  if (!read_) out.held_ = held_.slice(begin, end);
  return out;
}

Track Surfaces::block(int64_t first, int64_t count, std::vector<double>& memory) const {
  if (!read_) return held_.slice(first, first + count);
  read_(first_ + first, count, memory);
  return {memory.data(), count, points_};
}

std::unique_ptr<SurfaceMeter> distance_meter(const Alignment& how) {
  if (how.mode == Mode::sequence) return std::make_unique<AlignedDistance>(how.scale);
  return std::make_unique<Distance>(how);
}
std::unique_ptr<SurfaceMeter> edge_meter(NeighbourFrame where) {
  return std::make_unique<Edges>(where);
}
std::unique_ptr<SurfaceMeter> squared_meter() { return std::make_unique<Squared>(); }
std::unique_ptr<SurfaceMeter> squared_npt_meter() { return std::make_unique<SquaredNpt>(); }
std::unique_ptr<SurfaceMeter> floor_meter() { return std::make_unique<Floor>(); }
std::unique_ptr<SurfaceMeter> leaf_meter(const Track& joints) {
  if (!joints.present() || joints.frames == 0 || joints.points != kJoints) return nullptr;
  return std::make_unique<Leaves>(joints);
}

void measure(const Surfaces& pred, const Surfaces& truth,
             std::span<const std::unique_ptr<SurfaceMeter>> meters) {
  std::vector<SurfaceMeter*> wanting;
  for (const auto& meter : meters)
    if (meter) wanting.push_back(meter.get());
  if (wanting.empty()) return;
  const int64_t frames = truth.frames(),
                step = std::max<int64_t>(1, kBlockBytes / (24 * truth.points()));
  std::vector<double> a, b;
  while (!wanting.empty()) {
    for (int64_t f = 0; f < frames; f += step) {
      const int64_t n = std::min(step, frames - f);
      const Track p = pred.block(f, n, a), t = truth.block(f, n, b);
      for (SurfaceMeter* meter : wanting) meter->add(p, t);
    }
    std::erase_if(wanting, [](SurfaceMeter* meter) { return !meter->again(); });
  }
}

Value floor_penetration_mm(const Track& pred, const Track& truth) {
  return measured(floor_meter(), pred, truth);
}

Value leaf_vertex_distance(const Track& pred, const Track& truth, const Track& joints) {
  if (joints.frames != truth.frames) return std::nullopt;
  return measured(leaf_meter(joints), pred, truth);
}

Value percentile(std::vector<double> values, double share) {
  const auto finite_one = [](double value) { return std::isfinite(value); };
  if (values.empty() || !std::all_of(values.begin(), values.end(), finite_one)) return std::nullopt;
  const auto k = static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return finite(values[static_cast<size_t>(k)]);
}

}  // namespace restage::metrics
