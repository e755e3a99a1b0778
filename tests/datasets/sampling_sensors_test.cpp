// Clouds as cameras see them, people in clothes, and what an extractor is asked about.
#include "datasets/sampling/sensors.h"

#include <gtest/gtest.h>

#include <numeric>

#include <cmath>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/dress.h"
#include "datasets/sampling/evaluation.h"
#include "datasets/sampling/intruder.h"
#include "datasets/sampling/things.h"
#include "datasets/sampling/tracks.h"
#include "datasets/sampling/windows.h"
#include "tests/datasets/sampling_support.h"

namespace restage {
namespace {

using namespace testing;

/// A ball of the size of a trunk, and a small one at its centre that nobody can see.
struct Balls {
  Balls() {
    for (uint64_t i = 0; i < 3000; ++i) {
      Rng rng(RngKey{i, 1});
      const Point way = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized().cast<float>();
      points.push_back((i % 3 == 0 ? 0.06f : 0.35f) * way);
      normals.push_back(way);
    }
  }
  Points points, normals;
};

TEST(SamplingSensors, SeeTheNearSideAndNothingInside) {
  const Balls balls;
  for (uint64_t k = 0; k < 30; ++k) {
    for (const Sensor sensor : {Sensor::one_camera, Sensor::ring}) {
      std::vector<size_t> which;
      const Points seen =
          sensed({sensor}, balls.points, balls.normals, 400, RngKey{k, 0}, RngKey{k, 1}, &which);
      ASSERT_EQ(seen.size(), which.size());
      EXPECT_LE(seen.size(), 400u);
      EXPECT_GE(seen.size(), 128u);
      EXPECT_EQ(std::set<size_t>(which.begin(), which.end()).size(), which.size());
      Point mean = Point::Zero();
      size_t inside = 0, moved = 0;
      for (size_t i = 0; i < seen.size(); ++i) {
        mean += balls.points[which[i]] / static_cast<float>(seen.size());
        inside += which[i] % 3 == 0;
        moved += (seen[i] - balls.points[which[i]]).norm() > 0.04f;
      }
      EXPECT_LT(static_cast<double>(inside), 0.02 * static_cast<double>(seen.size()));
      EXPECT_LT(static_cast<double>(moved), 0.08 * static_cast<double>(seen.size()));
      if (sensor == Sensor::one_camera) {
        EXPECT_GT(mean.norm(), 0.16f) << "one side only";
        for (const size_t i : which) EXPECT_GT(balls.points[i].dot(mean.normalized()), -0.16f);
      } else {
        EXPECT_LT(mean.norm(), 0.16f);
      }
    }
  }
}

TEST(SamplingSensors, NormalsPointOutHoweverFacesAreWound) {
  Body body = tiny_body("b", "train");
  const auto check = [&] {
    const SurfaceSampler sampler(body);
    const SurfaceSamples samples = sampler.draw({1, 0}, 300);
    const Points picked = samples.rest_vertices(body), at = samples.on(picked),
                 normals = sampler.normals(samples, picked);
    Points out;
    for (size_t i = 0; i < at.size(); ++i) {
      EXPECT_NEAR(normals[i].norm(), 1, 1e-5);
      out.push_back(normals[i]);
    }
    return out;
  };
  const Points before = check();
  for (Triangle& f : body.rest.faces) std::swap(f[1], f[2]);
  const Points after = check();
  size_t same = 0;
  for (size_t i = 0; i < before.size(); ++i) same += (before[i] - after[i]).norm() < 1e-4f;
  EXPECT_GT(same, 0u);
}

/// Mean distance of a cloud's points from the pelvis: more in thicker clothes.
double spread(const CloudSampler& sampler, const CloudSubject& subject) {
  double sum = 0;
  for (uint64_t k = 0; k < 20; ++k)
    for (const Point& p : sampler.cloud(subject, 400, RngKey{k, 0}, RngKey{k, 1}))
      sum += static_cast<double>(p.norm());
  return sum;
}

TEST(SamplingSensors, ClothesStandOutAndScenesStay) {
  const CloudSampler sampler(training_corpus(), {.points = 256, .noise = 0}, 1);
  CloudSubject naked;
  naked.at = {0, 3};
  CloudSubject dressed = naked;
  dressed.dressed = true;
  EXPECT_NE(spread(sampler, naked), spread(sampler, dressed));
  // One scene, two frames: the same clothes and cameras, other points.
  dressed.sensor = Sensor::one_camera;
  const auto centre = [&](uint64_t scene, uint64_t key) {
    return centroid(sampler.cloud(dressed, 400, RngKey{scene, 0}, RngKey{key, 1}));
  };
  EXPECT_NE(centre(1, 1), centre(1, 2));
  EXPECT_LT((centre(1, 1) - centre(1, 2)).norm(), (centre(1, 1) - centre(4, 1)).norm() + 0.05f);
}

TEST(SamplingSensors, RecombinedPosesMoveOneLimbOnly) {
  const CloudSampler sampler(training_corpus(), {.points = 64}, 1);
  CloudSubject subject;
  subject.at = {0, 3};
  const Pose plain = sampler.pose(subject);
  subject.limb = 13;  // the left arm
  subject.limb_at = {0, 25};
  const Pose mixed = sampler.pose(subject);
  for (int j = 0; j < kJoints; ++j) {
    const bool arm = j == 13 || j == 16 || j == 18 || j == 20;
    EXPECT_EQ(plain.local[j] != mixed.local[j], arm) << kJointNames[j];
  }
}

TEST(SamplingSensors, ShareOfEachKindAndEverybodyOtherwise) {
  CloudConfig config{.points = 96};
  const CloudSampler plain(training_corpus(), config, 1);
  config.one_camera = 0.4;
  config.camera_ring = 0.3;
  config.dressed = config.recombined = 0.5;
  const CloudSampler mixed(training_corpus(), config, 1);
  std::map<Sensor, int> sensors;
  int dressed = 0, limbs = 0;
  for (int64_t i = 0; i < 1000; ++i) {
    const CloudSubject a = plain.subject(i), b = mixed.subject(i);
    EXPECT_EQ(a.body, b.body);  // a switch does not change what else is drawn
    EXPECT_EQ(a.at.frame, b.at.frame);
    EXPECT_EQ(a.limb, -1);
    ++sensors[b.sensor];
    dressed += b.dressed;
    limbs += b.limb >= 0;
  }
  EXPECT_NEAR(sensors[Sensor::one_camera], 380, 60);
  EXPECT_NEAR(sensors[Sensor::ring], 285, 60);
  EXPECT_NEAR(dressed, 500, 60);
  EXPECT_NEAR(limbs, 500, 60);
  const CloudBatch batch = mixed.batch(0, 40);
  for (int64_t i = 0; i < batch.points.numel(); ++i)
    ASSERT_TRUE(std::isfinite(batch.points.data<float>()[i]));
  config.one_camera = 0.8;
  EXPECT_THROW(CloudSampler(training_corpus(), config, 1), InputError);
}

TEST(SamplingSensors, EvaluationScansShowTheirJoints) {
  const auto subjects = evaluation_clouds(training_corpus(), 4, 1);
  for (const int cameras : {1, 6}) {
    EvaluationScans how{.cameras = cameras, .points = 200};
    const CloudBatch scans = evaluation_scans(training_corpus(), subjects, how, 1);
    EXPECT_TRUE(
        same_bits(scans.points, evaluation_scans(training_corpus(), subjects, how, 1).points));
    for (int64_t i = 0; i < 4; ++i)
      for (int j = 0; j < kJoints; ++j) EXPECT_LT(at(scans.joints, i, j).norm(), 2.0);
    how.intruder = true;
    const CloudBatch two = evaluation_scans(training_corpus(), subjects, how, 1);
    int strangers = 0;
    for (int64_t i = 0; i < 4; ++i)
      for (int p = 0; p < 200; ++p) {
        double nearest = 1e9;
        for (int j = 0; j < kJoints; ++j)
          nearest = std::min(nearest, (at(two.points, i, p) - at(two.joints, i, j)).norm());
        strangers += nearest > 0.3;
      }
    EXPECT_GT(strangers, 20);
    EXPECT_LT(strangers, 400);
  }
}

TEST(SamplingSensors, IntrudersAreNobodysPoints) {
  CloudConfig config{.points = 256, .noise = 0};
  config.one_camera = 1;
  config.skin_weights = true;
  const CloudSampler alone(training_corpus(), config, 1);
  config.intruder = 1;
  const CloudSampler sampler(training_corpus(), config, 1);
  const CloudBatch batch = sampler.batch(0, 40), without = alone.batch(0, 40);
  int strangers = 0;
  for (int64_t i = 0; i < 40; ++i) {
    EXPECT_EQ(sampler.subject(i).intruder, !sampler.subject(i).rest);
    int own = 0;
    for (int64_t p = 0; p < 256; ++p) {
      const float* w = batch.weights.data<float>() + (i * 256 + p) * kJoints;
      const float sum = std::accumulate(w, w + kJoints, 0.0f);
      const bool stranger = sum == 0;
      if (!stranger) {
        EXPECT_NEAR(sum, 1, 1e-4);
      }
      own += !stranger;
      strangers += stranger;
    }
    EXPECT_GT(own, 256 * 0.87);
  }
  EXPECT_GT(strangers, 40 * 256 * 0.02);
  for (int64_t k = 0; k < without.weights.numel() / kJoints; ++k) {
    const float* w = without.weights.data<float>() + k * kJoints;
    EXPECT_NEAR(std::accumulate(w, w + kJoints, 0.0f), 1, 1e-4);
  }
}

/// How many points of row i are of the person: those that a joint moves.
int own_points(const CloudBatch& batch, int64_t i) {
  int own = 0;
  const int64_t n = batch.points.size(1);
  for (int64_t p = 0; p < n; ++p) {
    const float* w = batch.weights.data<float>() + (i * n + p) * kJoints;
    own += std::accumulate(w, w + kJoints, 0.0f) > 0.5f;
  }
  return own;
}

Vec3 world(const CloudBatch& batch, int64_t i, int64_t p) {
  return at(batch.points, i, p) + at(batch.centres, i, 0);
}

double lowest_of(const CloudBatch& batch, int64_t i) {
  double out = 1e9;
  for (int64_t p = 0; p < batch.points.size(1); ++p) out = std::min(out, world(batch, i, p).y());
  return out;
}

/// The largest of `of_point(p)` over the points of a row.
template <class F>
double most_of(const CloudBatch& batch, const F& of_point) {
  double out = 0;
  for (int64_t p = 0; p < batch.points.size(1); ++p) out = std::max(out, of_point(p));
  return out;
}

TEST(SamplingSensors, ThingsAreNobodysPointsAndNear) {
  for (const double cameras : {0.0, 1.0}) {
    CloudConfig config{.points = 400, .noise = 0, .tpose_share = 0.2};
    config.camera_ring = cameras;
    config.things = 1;
    config.skin_weights = true;
    const CloudSampler sampler(training_corpus(), config, 1);
    const CloudBatch batch = sampler.batch(0, 40);
    EXPECT_TRUE(same_bits(batch.points, sampler.batch(0, 40).points));
    for (int64_t i = 0; i < 40; ++i) {
      const int own = own_points(batch, i);
      if (sampler.subject(i).rest) {
        EXPECT_EQ(own, 400);
        continue;
      }
      EXPECT_LT(own, 400);
      EXPECT_GT(own, 400 * 0.8);
      const double most = most_of(batch, [&](int64_t p) {
        double nearest = 1e9;
        for (int j = 0; j < kJoints; ++j)
          nearest = std::min(nearest, (at(batch.points, i, p) - at(batch.joints, i, j)).norm());
        return nearest;
      });
      EXPECT_LT(most, 1.3) << i;  // the far end of the longest stick
    }
  }
}

TEST(SamplingSensors, ThingsTouchTheirHandOrStandOnTheFloor) {
  const Joints joints = training_corpus().bodies[0].joints;
  Rng rng(RngKey{1, 0});
  int held = 0;
  for (int i = 0; i < 200; ++i) {
    const Thing thing = draw_thing(rng);
    const Points points = thing_points(thing, joints, -0.1, 300, rng);
    ASSERT_EQ(points.size(), 300u);
    held += thing.held;
    double nearest = 1e9, low = 1e9;
    const auto side = static_cast<size_t>(thing.left ? 0 : 1);
    const Vec3 joint = joints[(thing.held ? 20 : 10) + side];
    for (const Point& p : points) {
      Vec3 off = p.cast<double>() - joint;
      if (!thing.held) off.y() = 0;
      nearest = std::min(nearest, off.norm());
      low = std::min(low, double{p.y()});
    }
    EXPECT_LT(nearest, thing.held ? 0.19 : 0.35) << i;
    if (!thing.held) {
      EXPECT_NEAR(low, -0.1, 0.05) << i;
    }
  }
  EXPECT_GT(held, 60);
  EXPECT_LT(held, 140);
}

TEST(SamplingSensors, TheFloorIsCutWithTheSoles) {
  CloudConfig config{.points = 400, .noise = 0, .tpose_share = 0};
  const CloudSampler whole(training_corpus(), config, 1);
  config.cut_floor = 1;
  const CloudSampler cut(training_corpus(), config, 1);
  const CloudBatch a = whole.batch(0, 30), b = cut.batch(0, 30);
  for (int64_t i = 0; i < 30; ++i) {
    const double gone = lowest_of(b, i) - lowest_of(a, i);
    EXPECT_GE(gone, 0.0099) << i;
    EXPECT_LT(gone, 0.4) << i;  // bodies of boxes have few points low down
  }
}

TEST(SamplingSensors, SmoothingTakesCornersAway) {
  const Body& body = training_corpus().bodies[0];
  const Points moved = smoothing(body.rest);
  ASSERT_EQ(moved.size(), body.rest.vertices.size());
  double most = 0;
  for (const Body& each : training_corpus().bodies)
    for (const Point& p : smoothing(each.rest)) most = std::max(most, double{p.norm()});
  EXPECT_GT(most, 0.001);
  EXPECT_LT(most, 0.5);
  CloudConfig config{.points = 400, .noise = 0, .tpose_share = 0.5};
  const CloudSampler plain(training_corpus(), config, 1);
  config.smoothed = 1;
  const CloudSampler smooth(training_corpus(), config, 1);
  const CloudBatch a = plain.batch(0, 20), b = smooth.batch(0, 20);
  for (int64_t i = 0; i < 20; ++i) {
    const double change =
        most_of(a, [&](int64_t p) { return (world(a, i, p) - world(b, i, p)).norm(); });
    EXPECT_GT(change, 0.001) << i;
    EXPECT_LE(change, most + 1e-4) << i;
  }
}

TEST(SamplingSensors, LimbsAreWhatHangsOnAJoint) {
  const Body& body = training_corpus().bodies[0];
  Mesh arm = limb_of(body, 18);
  ASSERT_GT(arm.vertices.size(), 4u);
  ASSERT_FALSE(arm.faces.empty());
  for (const Point& p : arm.vertices) EXPECT_GT(p.x(), body.joints[16].x());
  for (const Triangle& t : arm.faces)
    for (const int v : t) EXPECT_LT(static_cast<size_t>(v), arm.vertices.size());
  Rng rng(RngKey{1, 0});
  for (int i = 0; i < 50; ++i) {
    const Intruder intruder = draw_intruder(rng, 3);
    EXPECT_LT(intruder.body, 3u);
    put_intruder(intruder, Vec3(5, 1, 5), arm.vertices);
    const Vec3 middle = centroid(arm.vertices).cast<double>() - Vec3(5, 1, 5);
    EXPECT_GT(std::hypot(middle.x(), middle.z()), 0.29);
    EXPECT_LT(std::hypot(middle.x(), middle.z()), 0.91);
    EXPECT_LT(std::abs(middle.y()), 0.61);
  }
}

TEST(SamplingTracks, RotationsAreAugmentedAsJointsAre) {
  const Body& body = training_corpus().bodies[0];
  const Pose pose = pose_on(training_corpus().motions[0], body, 3);
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  for (const Augmentation a : {Augmentation{0.7, false}, Augmentation{-1.2, true}}) {
    const Joints rest = augmented_rest(a, body.joints), joints = augmented(a, posed.joints);
    const Rotations global = augmented(a, posed.global);
    for (size_t j = 1; j < kJoints; ++j) {
      const auto parent = static_cast<size_t>(kParents[j]);
      const Vec3 bone = global[parent] * (rest[j] - rest[parent]);
      EXPECT_LT((joints[j] - joints[parent] - bone).norm(), 1e-9) << kJointNames[j] << a.mirror;
    }
  }
}

TEST(SamplingTracks, WindowsSeeWhatWasAnswered) {
  TrackConfig config{.sequences = 5, .frames = 20, .least = 100, .most = 200, .clouds = {}};
  int asked = 0;
  const Point offset(0, 3, 0);
  const auto extract = [&](const Points& cloud, const RngKey&, const SeenJoints*) {
    ++asked;
    SeenJoints out;
    out.turns.emplace();
    out.uncertainty.emplace();
    for (size_t j = 0; j < kJoints; ++j) {
      out.joints[j] =
          (centroid(cloud) + offset).cast<double>() + Vec3(0, 0.01 * static_cast<double>(j), 0);
      (*out.turns)[j] = Mat3::Identity();
      (*out.uncertainty)[j] = 0.001 * static_cast<double>(j);
    }
    return out;
  };
  const auto tracks = make_tracks(training_corpus(), config, 3, extract);
  ASSERT_EQ(tracks.size(), 5u);
  EXPECT_EQ(asked, 100);
  const auto part = make_tracks(training_corpus(), config, 3, extract, {1, 3});
  EXPECT_EQ(asked, 140) << "two of five";
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(part[i].first, tracks[i].first);
    EXPECT_EQ(part[i].frames.size(), i % 3 == 1 ? 20u : 0u);
  }
  EXPECT_EQ(part[4].frames[7].joints, tracks[4].frames[7].joints);
  WindowConfig windows{.frames = 12, .mirror = false, .remove_heading = false};
  const WindowSampler sampler(training_corpus(), windows, 1, &tracks);
  const WindowBatch batch = sampler.batch(0, 8);
  for (int64_t i = 0; i < 8; ++i) {
    const WindowSubject s = sampler.subject(i);
    ASSERT_NE(s.track, nullptr);
    EXPECT_EQ(s.body_a, s.track->body);
    EXPECT_EQ(s.clip.motion, s.track->motion);
    EXPECT_GE(s.clip.frame, s.track->first);
    EXPECT_LE(s.clip.frame + 12, s.track->first + 20);
    // Answers are in the world, whatever heading the extractor was shown.
    const Joints& answer = s.track->frames[s.clip.frame - s.track->first].joints;
    const Pose pose = pose_on(training_corpus().motions[s.clip.motion],
                              training_corpus().bodies[s.body_a], s.clip.frame);
    EXPECT_LT((answer[0] - offset.cast<double>() - pose.root).norm(), 0.5);
    for (int j = 0; j < kJoints; ++j) EXPECT_NEAR(at(batch.input_a, i, j).y(), 0.01 * j, 1e-5);
    EXPECT_GT(at(batch.joints_a, i, 15).y(), 0.2) << "what is true stays";
  }
  windows.mirror = true;
  const WindowSampler mirroring(training_corpus(), windows, 1, &tracks);
  const WindowBatch mirrored = mirroring.batch(0, 8);
  ASSERT_EQ(mirrored.turns.shape(), (Shape{8, 12, kJoints, 3, 3}));
  for (int64_t i = 0; i < 8; ++i) {
    const WindowSubject s = mirroring.subject(i);
    const SeenJoints& answer = s.track->frames[s.clip.frame - s.track->first];
    for (int j = 0; j < kJoints; ++j) {
      const int from = s.augmentation.mirror ? kMirror[static_cast<size_t>(j)] : j;
      EXPECT_FLOAT_EQ(mirrored.uncertainty.data<float>()[i * 12 * kJoints + j],
                      1e-3f * static_cast<float>(from));
      // An answer turned as the sample is: about y, by its heading or against it.
      const Mat3 turn = augmented(s.augmentation, *answer.turns)[static_cast<size_t>(j)];
      const float* got = mirrored.turns.data<float>() + 9 * (i * 12 * kJoints + j);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[3 * r + c], turn(r, c), 1e-5);
    }
  }
  const auto joints_only =
      make_tracks(training_corpus(), config, 3,
                  [](const Points&, const RngKey&, const SeenJoints*) { return Joints{}; });
  EXPECT_FALSE(
      WindowSampler(training_corpus(), windows, 1, &joints_only).batch(0, 1).turns.defined());
  config.frames = 10;
  const auto shorter = make_tracks(training_corpus(), config, 3, extract);
  EXPECT_THROW(WindowSampler(training_corpus(), windows, 1, &shorter), InputError);
}

}  // namespace
}  // namespace restage
