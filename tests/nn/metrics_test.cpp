// The oracle's values on small golden cases (metrics_golden.json, written by metrics_oracle.py) and
// the behaviour at the edges of the definitions.
#include "nn/metrics/metrics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "nn/geometry/skeleton.h"
#include "tests/support/errors.h"
#include "tests/support/use_set.h"

namespace restage::metrics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Stored {
  std::vector<double> values;
  Track track;
};

Stored stored(const nlohmann::json& json) {
  Stored out;
  for (const auto& frame : json)
    for (const auto& point : frame)
      for (const auto& x : point) out.values.push_back(x.get<double>());
  out.track = {out.values.data(), static_cast<int64_t>(json.size()),
               static_cast<int64_t>(json.at(0).size())};
  return out;
}

std::vector<double> noise(size_t count, uint64_t stream) {
  std::vector<double> values(count);
  Rng rng({11, stream});
  for (double& x : values) x = rng.normal();
  return values;
}

TEST(Metrics, AgreeWithTheOracle) {
  std::ifstream file(std::string(RESTAGE_SOURCE_DIR) + "/tests/nn/metrics_golden.json");
  const auto cases = nlohmann::json::parse(file);
  ASSERT_EQ(cases.size(), 6u);
  for (const auto& c : cases) {
    const Stored pj = stored(c["pred_joints"]), gj = stored(c["true_joints"]),
                 pv = stored(c["pred_vertices"]), gv = stored(c["true_vertices"]);
    const SequenceView view{pj.track, gj.track, pv.track, gv.track, pj.track.frames};
    for (const auto metrics : {table(), variants()})
      for (const Metric& metric : metrics) {
        if (!c["values"].contains(metric.name)) {  // below, and in tests/nn/contact_test.cpp
          EXPECT_HAS(
              "leaf_pa_mpvd side_swaps foot_slide_mm peak_speed floor_penetration_mm "
              "rotation_deg rotation_over_90",
              metric.name);
          continue;
        }
        const Value got = metric.compute(view);
        const auto& want = c["values"].at(metric.name);
        SCOPED_TRACE(c["name"].get<std::string>() + " " + metric.name);
        ASSERT_EQ(got.has_value(), !want.is_null());
        if (got) {
          EXPECT_NEAR(*got, want.get<double>(), 1e-9);
        }
      }
  }
}

TEST(Metrics, SidesAreSwappedWhereLeftIsNearerToRight) {
  std::vector<double> truth;  // two frames, 40 cm between the sides
  for (int t = 0; t < 2; ++t)
    for (int j = 0; j < kJoints; ++j) {
      const int other = kMirror[static_cast<size_t>(j)];
      truth.insert(truth.end(), {other > j ? 0.2 : other < j ? -0.2 : 0.0, 0.1 * j, 0.0});
    }
  std::vector<double> pred = truth;
  const auto track = [](const std::vector<double>& v) { return Track{v.data(), 2, kJoints}; };
  EXPECT_EQ(side_swaps(track(pred), track(truth)), 0.0);
  for (const size_t leg : {1, 2, 4, 5, 7, 8, 10, 11})  // of the second frame
    pred[3 * (static_cast<size_t>(kJoints) + leg)] *= -1;
  EXPECT_EQ(side_swaps(track(pred), track(truth)), 0.5);
  for (double& x : truth) x *= 0.1;  // sides so near that it means nothing
  for (double& x : pred) x *= 0.1;
  EXPECT_EQ(side_swaps(track(pred), track(truth)), 0.0);
  EXPECT_FALSE(side_swaps({pred.data(), 4, 11}, {truth.data(), 4, 11}));
  EXPECT_FALSE(side_swaps({pred.data(), 1, 3}, {truth.data(), 1, 22}));
  EXPECT_FALSE(mean_distance({pred.data(), 1, 22}, {truth.data(), 2, 22}));
}

TEST(Metrics, OfWhatIsNoNumberNothingIsSaid) {
  std::vector<double> truth(3 * 3 * kJoints);
  for (size_t i = 0; i < truth.size(); ++i) truth[i] = 0.01 * static_cast<double>(i * i % 97);
  std::vector<double> pred = truth;
  pred[40] = std::nan("");
  const Track p{pred.data(), 3, kJoints}, t{truth.data(), 3, kJoints};
  EXPECT_EQ(side_swaps(t, t), 0.0);
  EXPECT_FALSE(side_swaps(p, t));
  EXPECT_EQ(floor_penetration_mm(t, t), 0.0);
  EXPECT_FALSE(floor_penetration_mm(p, t));
  EXPECT_EQ(peak_speed_ratio(t, t), 1.0);
  EXPECT_FALSE(peak_speed_ratio(p, t));
}

TEST(Metrics, LeavesAreTheVerticesAroundHeadHandsAndFeet) {
  std::vector<double> joints;  // on a line, so that what is nearest is plain
  for (int j = 0; j < kJoints; ++j) joints.insert(joints.end(), {1.0 * j, 0, 0});
  std::vector<double> truth = joints;  // a vertex at every joint
  for (size_t j = 0; j < static_cast<size_t>(kJoints); ++j) truth[3 * j + 1] = 0.1 * (j % 3);
  for (size_t j = 0; j < static_cast<size_t>(kJoints); ++j) truth[3 * j + 2] = 0.1 * (j % 5);
  std::vector<double> pred = truth;
  for (const size_t leaf : {10, 11, 15, 20, 21}) pred[3 * leaf + 1] += 0.2;
  const auto track = [](const std::vector<double>& v) { return Track{v.data(), 1, kJoints}; };
  const Alignment frame{Alignment::Mode::frame, true};
  const auto each = distances(track(pred), track(truth), frame);
  EXPECT_NEAR(*leaf_vertex_distance(track(pred), track(truth), track(joints)),
              (each[10] + each[11] + each[15] + each[20] + each[21]) / 5, 1e-12);
  EXPECT_GT(*leaf_vertex_distance(track(pred), track(truth), track(joints)),
            *mean_distance(track(pred), track(truth), frame));
  EXPECT_FALSE(leaf_vertex_distance(track(pred), track(truth), {}));
  EXPECT_FALSE(leaf_vertex_distance({}, track(truth), track(joints)));
}

TEST(Metrics, ClaimsOfWhereAPointIsAreCounted) {
  const std::vector<double> truth = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
  std::vector<double> pred = truth;
  pred[1] += 0.3, pred[3] += 0.3, pred[8] -= 0.4, pred[6] += 0.3;  // off by 0.3, 0.3, 0.5, 0
  const std::vector<double> radius = {0.31, 0.29, 0.5 + 1e-9, 1e-9};
  EXPECT_EQ(share_within({pred.data(), 2, 2}, {truth.data(), 2, 2}, radius), 0.75);
  EXPECT_FALSE(share_within({}, {}, {}));
}

TEST(Metrics, SureFramesAreCountedFirst) {
  const std::vector<double> confidence = {0.9, 0.1, 0.9, 0.5}, errors = {1, 8, 2, 5};
  const auto curve = risk_coverage(confidence, errors);
  ASSERT_EQ(curve.size(), 6u);
  EXPECT_NEAR(curve.front().risk, 4, 1e-12);
  EXPECT_NEAR(curve[3].risk, (1 + 2 + 5) / 3.0, 1e-12) << "80 % of four are three";
  EXPECT_NEAR(curve.back().risk, 1.5, 1e-12);
  EXPECT_TRUE(risk_coverage({}, {}).empty());
}

TEST(Metrics, WhatCannotBeComputedHasNoValue) {
  const auto a = noise(2 * 6 * 3, 1), b = noise(2 * 6 * 3, 2);
  const Track x{a.data(), 2, 6}, y{b.data(), 2, 6}, absent;
  EXPECT_TRUE(mean_distance(x, y));
  EXPECT_FALSE(mean_distance(x, absent));
  EXPECT_FALSE(mean_distance(absent, y));
  EXPECT_FALSE(acceleration_error(x, y)) << "two frames";
  const SequenceView six{{}, {}, x, y, x.frames};
  EXPECT_FALSE(table()[6].compute(six)) << "edges of six points";
  EXPECT_FALSE(mean_distance(x.slice(0, 0), y.slice(0, 0))) << "no frames";
  const std::vector<double> collapsed(2 * 6 * 3, 0.5);
  EXPECT_FALSE(mean_distance({collapsed.data(), 2, 6}, y, {Alignment::Mode::frame}));
  EXPECT_TRUE(mean_distance({collapsed.data(), 2, 6}, y, {Alignment::Mode::frame, false}));
}

TEST(Metrics, ValuesThatAreNotFiniteGiveNoValueAndNoCrash) {
  const auto a = noise(4 * 30 * 3, 3);
  for (const double bad : {kNaN, HUGE_VAL, 1e200}) {
    auto b = noise(4 * 30 * 3, 4);
    b[17] = bad;
    const Track x{a.data(), 4, 30}, y{b.data(), 4, 30};
    const SequenceView forward{x, y, x, y, 4}, backward{y, x, y, x, 4};
    for (const Metric& metric : table())
      for (const SequenceView* view : {&forward, &backward}) {
        const Value value = metric.compute(*view);
        EXPECT_TRUE(!value || std::isfinite(*value)) << metric.name << " " << bad;
      }
  }
}

TEST(Metrics, ProcrustesFindsTheMapAndExcludesReflections) {
  const auto a = noise(22 * 3, 5);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  std::vector<double> b(a.size()), mirrored(a);
  for (size_t i = 0; i < 22; ++i) {
    Eigen::Map<Eigen::Vector3d> moved(&b[3 * i]);
    moved = 0.7 * turn * Eigen::Map<const Eigen::Vector3d>(&a[3 * i]) + Eigen::Vector3d(1, 2, 3);
    mirrored[3 * i] *= -1;
  }
  const Similarity map = procrustes(a.data(), b.data(), 22, true);
  EXPECT_LT((map.linear - 0.7 * turn).norm(), 1e-12);
  EXPECT_LT((map.shift - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  const Similarity other = procrustes(a.data(), mirrored.data(), 22, false);
  EXPECT_NEAR(other.linear.determinant(), 1.0, 1e-12);
}

TEST(Metrics, NeighboursAreExactAndTiesGoToTheLowerIndex) {
  std::vector<double> grid;  // 5 x 5 x 5, full of ties
  for (int x = 0; x < 5; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 5; ++z) grid.insert(grid.end(), {double(x), double(y), double(z)});
  for (const auto& points : {grid, noise(500 * 3, 6), std::vector<double>(40 * 3, 0.25)}) {
    const auto count = static_cast<int64_t>(points.size() / 3);
    const auto near = nearest_neighbours(points.data(), count);
    ASSERT_EQ(near.size(), static_cast<size_t>(count * kEdgeNeighbours));
    const Track track{points.data(), 1, count};
    for (int64_t i = 0; i < count; ++i) {
      std::vector<std::pair<double, int64_t>> all;
      for (int64_t j = 0; j < count; ++j)
        if (j != i) all.emplace_back((track.at(0, i) - track.at(0, j)).squaredNorm(), j);
      std::sort(all.begin(), all.end());
      for (size_t k = 0; k < kEdgeNeighbours; ++k)
        ASSERT_EQ(near[static_cast<size_t>(i) * kEdgeNeighbours + k], all[k].second) << i;
    }
  }
}

TEST(Metrics, MeanLeavesOutSequencesWithoutAValue) {
  const auto a = noise(7 * 22 * 3, 7), b = noise(7 * 22 * 3, 8);
  const Track x{a.data(), 7, 22}, y{b.data(), 7, 22};
  std::vector<SequenceView> views(2);
  views[0] = {x.slice(0, 2), y.slice(0, 2), {}, {}, 2};
  views[1] = {x.slice(2, 7), y.slice(2, 7), {}, {}, 5};
  const Evaluation all = evaluate(views);
  EXPECT_DOUBLE_EQ(*all.mean[0], (*all.sequences[0][0] + *all.sequences[1][0]) / 2);
  EXPECT_FALSE(all.sequences[0][2]) << "acc of two frames";
  EXPECT_EQ(*all.mean[2], *all.sequences[1][2]);
  EXPECT_FALSE(all.mean[4]) << "no vertices";
  views[1].true_joints = y.slice(0, 4);
  EXPECT_THROW(evaluate(views), WorkError);
}

TEST(Metrics, SameBitsForAnyNumberOfThreads) {
  const auto a = noise(9 * 50 * 3, 9), b = noise(9 * 50 * 3, 10);
  const Track x{a.data(), 9, 50}, y{b.data(), 9, 50};
  const std::vector<SequenceView> views{{x, y, x, y, 9}};
  const auto mean = [&](int n) {
    const testing::UseThreads use(n);
    return evaluate(views).mean;
  };
  for (const int n : {2, 3}) EXPECT_EQ(mean(n), mean(1)) << n << " threads";
}

/// A long sequence is read some frames at a time: of all frames a few are ever held, and every
/// metric has the bits that it has of tracks in memory.
TEST(Metrics, SurfacesThatAreReadHaveTheSameBits) {
  constexpr int64_t kFrames = 7, kPoints = 120000;
  std::vector<double> a = noise(3 * kPoints, 14), b = noise(3 * kPoints, 15);
  for (std::vector<double>* one : {&a, &b})  // cheaper than seven times as much noise
    for (int64_t i = 0; i < 3 * kPoints * (kFrames - 1); ++i)
      one->push_back((*one)[static_cast<size_t>(i)] * 1.01 + 0.001 * static_cast<double>(i % 7));
  const auto ja = noise(kFrames * 66, 16), jb = noise(kFrames * 66, 17);
  const Track x{ja.data(), kFrames, kJoints}, y{jb.data(), kFrames, kJoints};
  int64_t most = 0;
  const auto read = [&](const std::vector<double>& from) {
    return [&](int64_t first, int64_t count, std::vector<double>& out) {
      most = std::max(most, count);
      out.assign(from.begin() + 3 * kPoints * first, from.begin() + 3 * kPoints * (first + count));
    };
  };
  const Track p{a.data(), kFrames, kPoints}, t{b.data(), kFrames, kPoints};
  const Surfaces p_read(kFrames, kPoints, read(a)), t_read(kFrames, kPoints, read(b));
  std::vector<Metric> metrics;
  for (const auto from : {table(), variants()})
    for (const Metric& metric : from)
      if (std::string(metric.name).find("medl") == std::string::npos) metrics.push_back(metric);
  const std::vector<SequenceView> held{{x, y, p, t, kFrames}, {x, y, p.slice(2, 5), t.slice(2, 5)}},
      streamed{{x, y, p_read, t_read, kFrames}, {x, y, p_read.slice(2, 5), t_read.slice(2, 5)}};
  const Evaluation want = evaluate(held, metrics), got = evaluate(streamed, metrics);
  EXPECT_LE(most * kPoints * 24, int64_t{16} << 20);
  for (size_t s = 0; s < 2; ++s)
    for (size_t m = 0; m < metrics.size(); ++m)
      EXPECT_EQ(got.sequences[s][m], want.sequences[s][m]) << s << " " << metrics[m].name;
  EXPECT_EQ(*want.sequences[0][4], *mean_distance(p, t)) << "and those of the plain definition";
  EXPECT_EQ(*want.sequences[0][5], *mean_distance(p, t, {Alignment::Mode::frame}));
  const Alignment sequence{Alignment::Mode::sequence};
  for (size_t m = 0; m < metrics.size(); ++m)
    if (std::string(metrics[m].name) == "pa_mpvd_sequence") {
      EXPECT_EQ(*got.sequences[0][m], *mean_distance(p, t, sequence));
    }
}

TEST(Metrics, EdgesOfSurfacesThatAreReadHaveTheSameBits) {
  constexpr int64_t kFrames = 13, kPoints = 60000;
  std::vector<double> a = noise(3 * kPoints, 18), b = noise(3 * kPoints, 19);
  const auto read = [&](const std::vector<double>& from) {  // all frames alike
    return [&](int64_t, int64_t count, std::vector<double>& out) {
      out.clear();
      for (int64_t f = 0; f < count; ++f) out.insert(out.end(), from.begin(), from.end());
    };
  };
  const SequenceView streamed{{}, {}, {kFrames, kPoints, read(a)}, {kFrames, kPoints, read(b)}};
  const SequenceView one{{}, {}, Track{a.data(), 1, kPoints}, Track{b.data(), 1, kPoints}};
  for (const auto from : {table(), variants()})
    for (const Metric& metric : from)
      if (std::string(metric.name).starts_with("medl")) {
        EXPECT_NEAR(*metric.compute(streamed), *metric.compute(one), 1e-9) << metric.name;
      }
}

TEST(Metrics, ErrorsByPointAverageToTheMeanDistance) {
  const auto a = noise(5 * 22 * 3, 12), b = noise(5 * 22 * 3, 13);
  const Track x{a.data(), 5, 22}, y{b.data(), 5, 22};
  const auto each = mean_distance_by_point(x, y, {Alignment::Mode::frame});
  ASSERT_EQ(each.size(), 22u);
  double mean = 0;
  for (const double e : each) mean += e / 22;
  EXPECT_NEAR(mean, *mean_distance(x, y, {Alignment::Mode::frame}), 1e-12);
}

TEST(Metrics, RotationErrorsAreAngles) {
  // Two frames: joint 3 is 60 degrees off in the first, 120 in the second, once with the sign
  // turned, which is the same rotation.
  std::vector<double> truth, pred;
  for (int i = 0; i < 2 * 22; ++i) truth.insert(truth.end(), {1, 0, 0, 0});
  pred = truth;
  const auto set = [&](int frame, int joint, double degrees, double sign) {
    double* q = &pred[static_cast<size_t>(4 * (22 * frame + joint))];
    const double half = degrees / 2 * std::acos(-1.0) / 180;
    q[0] = sign * std::cos(half), q[2] = sign * std::sin(half);
  };
  set(0, 3, 60, 1);
  set(1, 3, 120, -1);
  const auto error = rotation_error(pred, truth);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->by_joint[3], 90, 1e-9);
  EXPECT_NEAR(error->by_joint[4], 0, 1e-9);
  EXPECT_NEAR(error->mean, 90.0 / 22, 1e-9);
  EXPECT_NEAR(error->over_90, 1.0 / 44, 1e-12);
  EXPECT_FALSE(rotation_error({}, {}));
  EXPECT_FALSE(rotation_error(pred, std::span(truth).first(88)));
}

}  // namespace
}  // namespace restage::metrics
