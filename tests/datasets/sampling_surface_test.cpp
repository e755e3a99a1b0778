// Points of surfaces, drawn or seen by virtual depth cameras, and mirror images of skeletons.
#include "datasets/sampling/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "datasets/sampling/augment.h"
#include "datasets/sampling/normals.h"
#include "datasets/sampling/scanner.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_body;
using testing::tiny_motion;

/// Two triangles in the plane z = 0, the second of three times the first's area.
Body two_triangles() {
  Body body;
  body.id = "triangles";
  body.rest.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {8, 0, 0}, {5, 1, 0}};
  body.rest.faces = {{0, 1, 2}, {3, 4, 5}};
  body.weights.setZero(6, kJoints);
  return body;
}

TEST(SamplingSurface, PointsAreUniformByArea) {
  const Body body = two_triangles();
  const size_t n = 20000;
  const Points points = SurfaceSampler(body).draw({7, 1}, n).on_rest(body);
  size_t second = 0, near = 0;
  for (const Point& p : points) {
    EXPECT_EQ(p.z(), 0.0f);
    const bool in_second = p.x() > 2.0f;
    const float x = in_second ? (p.x() - 5.0f) / 3.0f : p.x();
    EXPECT_GE(x, -1e-6f);
    EXPECT_GE(p.y(), 0.0f);
    EXPECT_LE(x + p.y(), 1.0f + 1e-5f);
    second += in_second;
    near += x + p.y() < 0.5f;  // a quarter of the area of either triangle
  }
  // Five standard deviations.
  EXPECT_NEAR(static_cast<double>(second) / n, 0.75, 5 * std::sqrt(0.75 * 0.25 / n));
  EXPECT_NEAR(static_cast<double>(near) / n, 0.25, 5 * std::sqrt(0.75 * 0.25 / n));
}

TEST(SamplingSurface, WeightsAreBarycentricAndKeysDecide) {
  const SurfaceSampler sampler(tiny_body("b", "train"));
  const SurfaceSamples a = sampler.draw({1, 2}, 300), b = sampler.draw({1, 3}, 300);
  for (size_t i = 0; i < a.size(); ++i) {
    float sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(a.weights[3 * i + k], 0.0f);
      sum += a.weights[3 * i + k];
    }
    EXPECT_NEAR(sum, 1.0f, 1e-6f);
  }
  EXPECT_EQ(a.weights, sampler.draw({1, 2}, 300).weights);
  EXPECT_NE(a.weights, b.weights);
}

TEST(SamplingSurface, SurfacesWithoutPointsAreErrors) {
  Body body = two_triangles();
  for (const std::vector<Triangle>& faces :
       {std::vector<Triangle>{{0, 1, 6}}, std::vector<Triangle>{{0, 0, 1}}, {}}) {
    body.rest.faces = faces;
    EXPECT_THROW(SurfaceSampler{body}, InputError);
  }
}

TEST(SamplingSurface, NoiseHasTheAskedDeviation) {
  const int n = 20000;
  Points points(n, Point::Zero());
  add_noise({3, 4}, 0.02, points);
  Vec3 sum = Vec3::Zero(), square = Vec3::Zero(), product = Vec3::Zero();
  for (const Point& p : points) {
    const Vec3 x = p.cast<double>() / 0.02;
    sum += x;
    square += x.cwiseProduct(x);
    product += Vec3(x.x() * x.y(), x.y() * x.z(), x.z() * x.x());
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sum[c] / n, 0.0, 5 / std::sqrt(n));
    EXPECT_NEAR(square[c] / n, 1.0, 5 * std::sqrt(2.0 / n));
    EXPECT_NEAR(product[c] / n, 0.0, 5 / std::sqrt(n));
  }
}

TEST(SamplingSurface, MirroredPosesAreMirrorImages) {
  const Body body = tiny_body("b", "train", 1.0, 1.2);
  Joints rest = body.joints;
  rest[4].x() += 0.03;  // a body whose sides differ
  const Pose pose = pose_on(tiny_motion("m", "s", "train", 12), body, 11);
  const Augmentation a{0.8, true};
  const PosedSkeleton plain = forward_kinematics(rest, pose);
  const PosedSkeleton image = forward_kinematics(augmented_rest(a, rest), augmented(a, pose));
  const Joints expected = augmented(a, plain.joints);
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3::UnitY()).toRotationMatrix();
  for (int j = 0; j < kJoints; ++j) {
    EXPECT_LT((image.joints[j] - expected[j]).norm(), 1e-12);
    // The left side of the image is the flipped right side.
    const Vec3 other = turn * plain.joints[kMirror[j]];
    EXPECT_LT((image.joints[j] - Vec3(-other.x(), other.y(), other.z())).norm(), 1e-12);
    EXPECT_NEAR(image.global[j].determinant(), 1.0, 1e-12);
  }
  Points points = {plain.joints[20].cast<float>()};
  augment(a, points);
  EXPECT_LT((points[0].cast<double>() - image.joints[21]).norm(), 1e-6);
}

// ---- depth cameras
// -------------------------------------------------------------------------------

/// A ball of radius 0.5 m about (0, 1, 0).
Mesh ball() {
  constexpr int kRows = 24, kColumns = 48;
  Mesh out;
  for (int r = 0; r <= kRows; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const double polar = std::numbers::pi * r / kRows,
                   around = 2 * std::numbers::pi * c / kColumns;
      out.vertices.push_back(Vec3(0.5 * std::sin(polar) * std::sin(around),
                                  1 + 0.5 * std::cos(polar),
                                  0.5 * std::sin(polar) * std::cos(around))
                                 .cast<float>());
    }
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const int next = (c + 1) % kColumns;
      const auto at = [&](int row, int column) { return row * kColumns + column; };
      out.faces.push_back({at(r, c), at(r + 1, c), at(r + 1, next)});
      out.faces.push_back({at(r, c), at(r + 1, next), at(r, next)});
    }
  return out;
}

constexpr ScannerNoise kPerfect{0, 0, 0, 0, 0, 0.05, 0.3, 0};

double off_surface(const Point& p) { return (p.cast<double>() - Vec3(0, 1, 0)).norm() - 0.5; }

TEST(SamplingScanner, OneCameraSeesTheNearSideAlone) {
  const DepthCamera camera{Vec3(0, 1, 3), Vec3(0, 1, 0), 0.5, 120, 120};
  const Points points = scan_surface(ball(), {camera}, kPerfect, {1, 0});
  ASSERT_GT(points.size(), 2000u);
  for (const Point& p : points) {
    EXPECT_NEAR(off_surface(p), 0, 0.005);  // facets
    EXPECT_GT(p.z(), 0.05f);                // 0.083 can be seen of a ball, a little more of facets
  }
  // The middle of the image is the nearest point.
  double nearest = 1e9;
  for (const Point& p : points) nearest = std::min(nearest, (p.cast<double>() - camera.eye).norm());
  EXPECT_NEAR(nearest, 2.5, 0.005);
}

TEST(SamplingScanner, WhatStandsBeforeHidesWhatIsBehind) {
  Mesh scene = ball();
  const auto first = static_cast<int32_t>(scene.vertices.size());
  for (const Point& corner : {Point(-2, -1, 1), Point(2, -1, 1), Point(2, 3, 1), Point(-2, 3, 1)})
    scene.vertices.push_back(corner);
  scene.faces.push_back({first, first + 1, first + 2});
  scene.faces.push_back({first, first + 2, first + 3});
  const DepthCamera camera{Vec3(0, 1, 3), Vec3(0, 1, 0), 0.5, 60, 60};
  for (const Point& p : scan_surface(scene, {camera}, kPerfect, {1, 0}))
    ASSERT_NEAR(p.z(), 1, 1e-5);
}

TEST(SamplingScanner, ARingSeesAllSides) {
  DepthCamera model;
  model.view = 0.5;
  model.width = model.height = 60;
  const std::vector<DepthCamera> ring = camera_ring(8, 3, 0, Vec3(0, 1, 0), {0.6, 1.4}, model);
  ASSERT_EQ(ring.size(), 8u);
  EXPECT_NEAR((ring[0].eye - Vec3(0, 0.6, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR((ring[2].eye - Vec3(3, 0.6, 0)).norm(), 0, 1e-12) << "towards the body's left";
  int octants[8] = {};
  for (const Point& p : scan_surface(ball(), ring, kPerfect, {1, 0}))
    ++octants[(p.x() > 0) + 2 * (p.y() > 1) + 4 * (p.z() > 0)];
  for (const int count : octants) EXPECT_GT(count, 200);
}

TEST(SamplingScanner, ErrorsLieAlongTheRayAndGrowWithDistance) {
  ScannerNoise noise = kPerfect;
  noise.growth = 0.002;
  const auto spread = [&](double distance) {
    // The same number of pixels on the ball from any distance.
    const DepthCamera camera{Vec3(0, 1, distance), Vec3(0, 1, 0), 2 * std::atan(0.6 / distance), 90,
                             90};
    double sum = 0, aside = 0;
    const Points clean = scan_surface(ball(), {camera}, kPerfect, {1, 0});
    const Points noisy = scan_surface(ball(), {camera}, noise, {1, 0});
    EXPECT_EQ(clean.size(), noisy.size());
    for (size_t i = 0; i < std::min(clean.size(), noisy.size()); ++i) {
      const Vec3 error = (noisy[i] - clean[i]).cast<double>();
      const Vec3 ray = (clean[i].cast<double>() - camera.eye).normalized();
      sum += std::pow(error.dot(ray), 2);
      aside = std::max(aside, error.cross(ray).norm());
    }
    EXPECT_LT(aside, 1e-5);
    return std::sqrt(sum / static_cast<double>(clean.size()));
  };
  EXPECT_NEAR(spread(2), 0.002 * 1.65 * 1.65, 0.001);  // most of the ball is 1.5 to 1.9 m away
  EXPECT_GT(spread(4), 3.5 * spread(2));
}

TEST(SamplingScanner, OutlinesMixAndFlatViewsDropOut) {
  const DepthCamera camera{Vec3(0, 1, 3), Vec3(0, 1, 0), 0.5, 120, 120};
  const size_t all = scan_surface(ball(), {camera}, kPerfect, {1, 0}).size();
  ScannerNoise noise = kPerfect;
  noise.mixed = 1;
  size_t behind = 0;
  for (const Point& p : scan_surface(ball(), {camera}, noise, {1, 0}))
    behind += off_surface(p) > 0.01 && p.z() < 0.2f;
  EXPECT_GT(behind, 30u);
  EXPECT_LT(behind, all / 4);
  noise = kPerfect;
  noise.grazing = 0.5;
  const size_t steep = scan_surface(ball(), {camera}, noise, {1, 0}).size();
  EXPECT_LT(steep, all * 95 / 100);
  noise = kPerfect;
  noise.dropout = 0.4;
  EXPECT_NEAR(static_cast<double>(scan_surface(ball(), {camera}, noise, {1, 0}).size()),
              0.6 * static_cast<double>(all), 0.03 * static_cast<double>(all));
  noise = kPerfect;
  noise.outliers = 0.1;
  const Points stray = scan_surface(ball(), {camera}, noise, {1, 0});
  EXPECT_NEAR(static_cast<double>(stray.size()), 1.1 * static_cast<double>(all), 2);
}

TEST(SamplingScanner, IsAFunctionOfItsArguments) {
  const DepthCamera camera{Vec3(1, 1.3, 3), Vec3(0, 1, 0), 0.5, 60, 60};
  const Points a = scan_surface(ball(), {camera}, {}, {5, 1});
  EXPECT_EQ(a, scan_surface(ball(), {camera}, {}, {5, 1}));
  EXPECT_NE(a, scan_surface(ball(), {camera}, {}, {6, 1}));
  EXPECT_TRUE(scan_surface({}, {camera}, {}, {5, 1}).empty());
}

TEST(SamplingScanner, RefusesCamerasThatSeeNothing) {
  const DepthCamera good{Vec3(0, 1, 3), Vec3(0, 1, 0), 0.5, 60, 60};
  for (const auto& spoil :
       {+[](DepthCamera& c) { c.width = 0; }, +[](DepthCamera& c) { c.height = 100000; },
        +[](DepthCamera& c) { c.view = 0; }, +[](DepthCamera& c) { c.target = c.eye; }}) {
    DepthCamera bad = good;
    spoil(bad);
    EXPECT_THROW(scan_surface(ball(), {bad}, {}, {1, 0}), InputError);
  }
}

}  // namespace
}  // namespace restage
