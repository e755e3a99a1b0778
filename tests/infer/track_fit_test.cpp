#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/sampling/surface.h"
#include "infer/track/components.h"
#include "infer/track/tracker.h"

namespace restage {
namespace {

constexpr int kTakeFrames = 6;

const Body& tracked_body() {
  static const Body made = builtin_body(1, "test", 0);
  return made;
}

Mat3 turned(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

/// A step forwards with the arms lowered, a little farther in each frame.
Pose moving_pose(int frame) {
  const double t = frame / 30.0;
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.local[kPelvis] = turned(0.7 + t, Vec3::UnitY());
  pose.local[kLeftShoulder] = turned(-1.0 - t, Vec3::UnitZ());
  pose.local[kRightShoulder] = turned(0.9 + t, Vec3::UnitZ());
  pose.local[kLeftHip] = turned(-0.4 - t, Vec3::UnitX());
  pose.local[kRightKnee] = turned(0.5 + t, Vec3::UnitX());
  pose.root = tracked_body().joints[kPelvis] + Vec3(0.4 + t, -0.03, -0.2);
  return pose;
}

/// The person as scans show it: the belly stands out by up to 50 mm, as a full pocket does.
Body clothed() {
  Body out = tracked_body();
  const Vec3 belly = out.joints[kSpine2] + Vec3(0, 0, 0.1);
  for (Point& p : out.rest.vertices) {
    const double away = (p.cast<double>() - belly).norm();
    p.z() += static_cast<float>(0.05 * std::exp(-away * away / (2 * 0.07 * 0.07)));
  }
  return out;
}

bool is_back(const Body& body, size_t v) {
  return body.rest.vertices[v].z() < static_cast<float>(body.joints[kSpine2].z());
}

/// The points of a frame; with `front`, nothing that is behind the middle of the body at rest.
Points scanned(const Body& body, const Pose& pose, uint64_t key, bool front) {
  const SurfaceSamples drawn = SurfaceSampler(body).draw(RngKey{key, 0}, 9000);
  Points out = drawn.on_pose(body, pose);
  const Points rest = drawn.on_rest(body);
  add_noise(RngKey{key, 1}, 0.002, out);
  Points seen;
  for (size_t i = 0; i < out.size(); ++i)
    if (!front || rest[i].z() >= static_cast<float>(body.joints[kSpine2].z()))
      seen.push_back(out[i]);
  return seen;
}

/// The chain's answer: every joint some degrees off.
Pose rough(const Pose& truth, int frame) {
  Pose out = truth;
  for (int j = 0; j < kJoints; ++j)
    out.local[j] = turned(0.06, Vec3(std::sin(j), std::cos(j), std::sin(2.0 * j)).normalized()) *
                   truth.local[j];
  out.root += Vec3(0.015, -0.01, 0.012 + 0.001 * frame);
  return out;
}

double mean_distance(const Points& a, const Points& b, const std::function<bool(size_t)>& counts) {
  double sum = 0, count = 0;
  for (size_t v = 0; v < a.size(); ++v)
    if (counts(v)) sum += double{(a[v] - b[v]).norm()}, count += 1;
  return sum / count;
}

bool every_vertex(size_t) { return true; }

TEST(TrackFit, ThePoseComesBackFromSomeDegreesAndCentimetres) {
  const Body& body = tracked_body();
  const Pose truth = moving_pose(0), start = rough(truth, 0);
  const Pose found = fit_pose(body, make_scan(scanned(body, truth, 3, false), "scan"), start);
  const auto error = [&](const Pose& pose) {
    const Joints a = forward_kinematics(body.joints, pose).joints,
                 b = forward_kinematics(body.joints, truth).joints;
    double sum = 0;
    for (size_t j = 0; j < a.size(); ++j) sum += (a[j] - b[j]).norm() / kJoints;
    return sum;
  };
  EXPECT_GT(error(start), 0.03);
  EXPECT_LT(error(found), 0.012);
}

TEST(TrackFit, TheSurfaceFindsWhatThePoseCannotExplain) {
  const Body seen = clothed();
  Tracker tracker(tracked_body(), "template");
  TrackedFrame last;
  for (int f = 0; f < kTakeFrames; ++f) {
    const Points cloud = scanned(seen, moving_pose(f), 10 + static_cast<uint64_t>(f), false);
    last = tracker(rough(moving_pose(f), f), nullptr, &cloud, "scan");
  }
  const Points truth = pose_surface(seen, moving_pose(kTakeFrames - 1));
  const Points bare = linear_blend_skinning(tracked_body(), moving_pose(kTakeFrames - 1));
  const Points posed = linear_blend_skinning(tracked_body(), last.pose);  // the surface left out
  const auto pulled = [&](size_t v) {
    return (seen.rest.vertices[v] - tracked_body().rest.vertices[v]).norm() > 0.01f;
  };
  EXPECT_GT(mean_distance(bare, truth, pulled), 0.015);  // even in the true pose
  EXPECT_LT(mean_distance(last.vertices, truth, pulled), 0.008);
  EXPECT_LT(mean_distance(last.vertices, truth, pulled), 0.7 * mean_distance(posed, truth, pulled));
  EXPECT_LT(mean_distance(last.vertices, truth, every_vertex), 0.012);
  ASSERT_TRUE(last.distance);
  EXPECT_LT(last.distance->median, 0.003);
  EXPECT_LT(last.distance->p95, 0.012);
}

TEST(TrackFit, AHoleStaysWithThePose) {
  const Body& body = tracked_body();
  Tracker tracker(body, "template");
  TrackedFrame last;
  for (int f = 0; f < kTakeFrames; ++f) {
    const Points cloud = scanned(clothed(), moving_pose(f), 20 + static_cast<uint64_t>(f), true);
    last = tracker(rough(moving_pose(f), f), nullptr, &cloud, "scan");
  }
  const Points pose_only = linear_blend_skinning(body, last.pose);
  const auto back = [&](size_t v) { return is_back(body, v); };
  const auto trunk_back = [&](size_t v) {
    return is_back(body, v) && body.weights(static_cast<Eigen::Index>(v), kSpine2) > 0.3f &&
           body.rest.vertices[v].z() < static_cast<float>(body.joints[kSpine2].z()) - 0.05f;
  };
  EXPECT_LT(mean_distance(last.vertices, pose_only, back), 0.010);
  EXPECT_LT(mean_distance(last.vertices, pose_only, trunk_back), 0.008);
}

TEST(TrackFit, SkinningTheOffsetsGivesTheSurface) {
  const Points cloud = scanned(clothed(), moving_pose(2), 31, false);
  Tracker tracker(tracked_body(), "template");
  const TrackedFrame found = tracker(rough(moving_pose(2), 2), nullptr, &cloud, "scan");
  Body moved = tracker.body();
  for (size_t v = 0; v < found.offsets.size(); ++v) moved.rest.vertices[v] += found.offsets[v];
  EXPECT_LT(mean_distance(linear_blend_skinning(moved, found.pose), found.vertices, every_vertex),
            1e-5);
}

TEST(TrackFit, AFrameWithoutACloudKeepsWhatWasFound) {
  const Points cloud = scanned(clothed(), moving_pose(1), 41, false);
  Tracker tracker(tracked_body(), "template");
  const TrackedFrame seen = tracker(rough(moving_pose(1), 1), nullptr, &cloud, "scan");
  const TrackedFrame blind = tracker(rough(moving_pose(1), 1), nullptr, nullptr, "");
  EXPECT_FALSE(blind.distance);
  EXPECT_LT(mean_distance(seen.offsets, blind.offsets, every_vertex), 0.002);
  EXPECT_LT(mean_distance(seen.vertices, blind.vertices, every_vertex), 0.006);
  const Points chain = linear_blend_skinning(tracked_body(), rough(moving_pose(1), 1));
  EXPECT_GT(mean_distance(seen.vertices, chain, every_vertex), 0.015);
}

TEST(TrackFit, GoesOnFromWhatWasSaved) {
  const auto cloud = [](int f) {
    return scanned(clothed(), moving_pose(f), 50 + static_cast<uint64_t>(f), false);
  };
  const auto step = [&](Tracker& tracker, int f) {
    const Points points = cloud(f);
    return tracker(rough(moving_pose(f), f), nullptr, &points, "scan");
  };
  Tracker whole(tracked_body(), "template"), first(tracked_body(), "template");
  Tracker second(tracked_body(), "template");
  for (int f = 0; f < 2; ++f) step(whole, f), step(first, f);
  second.load(first.save(), "state");
  const TrackedFrame a = step(whole, 2), b = step(second, 2);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.offsets, b.offsets);
  Tracker fresh(tracked_body(), "template");
  EXPECT_NE(step(fresh, 2).vertices, a.vertices);
  EXPECT_THROW(second.load("short", "state"), InputError);
}

TEST(TrackFit, OffsetsBelongToTheFileThatStoresThem) {
  // A file in centimetres whose vertices lie on their side.
  const Mat3 stored = turned(0.5 * M_PI, Vec3::UnitX()) * 0.01;
  TrackOptions options;
  const Body& body = tracked_body();
  const Tracker plain(body, "template");
  options.skin = [&](const Pose& pose) {
    FileSkin out{skinned(plain.body(), pose), {}};
    const PosedSkeleton posed = forward_kinematics(body.joints, pose);
    for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
      Mat3 sum = Mat3::Zero();
      for (int j = 0; j < kJoints; ++j) sum += double{plain.body().weights(v, j)} * posed.global[j];
      out.blends.emplace_back(sum * stored);
    }
    return out;
  };
  Tracker tracker(body, "template", options);
  EXPECT_NEAR(tracker.stored_metre(), 100, 0.5);
  const Points cloud = scanned(clothed(), moving_pose(2), 31, false);
  const TrackedFrame found = tracker(rough(moving_pose(2), 2), nullptr, &cloud, "scan");
  Points back;
  for (const Vec3& p : tracker.surface(found.pose, found.offsets)) back.push_back(p.cast<float>());
  EXPECT_LT(mean_distance(back, found.vertices, every_vertex), 1e-5);
}

TEST(TrackFit, SaysWhatIsWrongWithATemplate) {
  Body cloud = tracked_body();
  cloud.rest.faces.clear();
  EXPECT_THROW(Tracker(cloud, "cloud.ply"), InputError);
}

TEST(TrackComponents, KeepTheErrorThatIsAskedFor) {
  // Three shapes that come and go, beside what is there always.
  std::vector<Points> offsets;
  for (int f = 0; f < 20; ++f) {
    Points frame;
    for (int v = 0; v < 300; ++v) {
      const float x = 0.1f * static_cast<float>(v), t = 0.5f * static_cast<float>(f);
      frame.push_back({0.01f + 0.02f * std::sin(x) * std::sin(t), 0.01f * std::cos(x + t),
                       0.005f * std::sin(3 * t)});
    }
    offsets.push_back(frame);
  }
  const OffsetFrames all = [&](const std::function<void(const Points&)>& visit) {
    for (const Points& frame : offsets) visit(frame);
  };
  const SurfaceComponents found = surface_components(all, 0.0005, 16);
  EXPECT_LE(found.error.p95, 0.0005);
  EXPECT_GE(found.deltas.size(), 3u);
  EXPECT_LE(found.deltas.size(), 8u);
  ASSERT_EQ(found.weights.size(), 20 * found.deltas.size());
  double worst = 0;
  for (size_t f = 0; f < offsets.size(); ++f)
    for (size_t v = 0; v < 300; ++v) {
      Point stored = found.mean[v];
      for (size_t k = 0; k < found.deltas.size(); ++k)
        for (size_t axis = 0; axis < 3; ++axis)
          stored[static_cast<int>(axis)] += found.weights[f * found.deltas.size() + k] *
                                            static_cast<float>(found.deltas[k][3 * v + axis]) /
                                            127.0f;
      worst = std::max(worst, double{(stored - offsets[f][v]).norm()});
    }
  EXPECT_NEAR(worst, found.error.max, 1e-5);
  EXPECT_TRUE(surface_components(all, 1, 16).deltas.empty());
  EXPECT_EQ(surface_components(all, 0, 2).deltas.size(), 2u);
}

}  // namespace
}  // namespace restage
