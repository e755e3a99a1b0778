// Points of surfaces and mirror images of skeletons.
#include "datasets/sampling/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/base/error.h"
#include "datasets/sampling/augment.h"
#include "datasets/sampling/normals.h"
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
  body.rest.faces = {{0, 1, 6}};
  EXPECT_THROW(SurfaceSampler{body}, InputError);
  body.rest.faces = {{0, 0, 1}};
  EXPECT_THROW(SurfaceSampler{body}, InputError);
  body.rest.faces.clear();
  EXPECT_THROW(SurfaceSampler{body}, InputError);
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

}  // namespace
}  // namespace restage
