// Normals of surfaces and keys of rotations, which readers and writers share.
#include "nn/geometry/normals.h"

#include <gtest/gtest.h>

#include "nn/geometry/rotation_key.h"

namespace restage {
namespace {

/// Two triangles that share an edge: one of area 0.5 in the plane y = 0, one of area 1 in x = 0. A
/// fifth vertex has no face, a sixth only one without area.
const Points kVertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 2, 0}, {5, 5, 5}, {7, 7, 7}};
const std::vector<Triangle> kFaces = {{0, 1, 2}, {0, 3, 1}, {5, 5, 5}};

TEST(Normals, AreWeightedByArea) {
  const auto normals = vertex_normals<Vec3>(kVertices, kFaces, Vec3::Zero());
  EXPECT_EQ(normals[2], Vec3(0, 1, 0));
  EXPECT_EQ(normals[3], Vec3(1, 0, 0));
  EXPECT_LT((normals[0] - Vec3(2, 1, 0).normalized()).norm(), 1e-15);
  EXPECT_EQ(normals[0], normals[1]);
}

TEST(Normals, AVertexWithoutAreaGetsWhatIsAsked) {
  const Points normals = vertex_normals<Point>(kVertices, kFaces, Point::UnitY());
  EXPECT_EQ(normals[4], Point(0, 1, 0));
  EXPECT_EQ(normals[5], Point(0, 1, 0));
}

TEST(Normals, AGroupHasOneNormal) {
  const std::vector<int32_t> group = {0, 1, 2, 2, 4, 5};
  const auto normals = vertex_normals<Vec3>(kVertices, kFaces, Vec3::Zero(), group);
  EXPECT_LT((normals[2] - Vec3(2, 1, 0).normalized()).norm(), 1e-15);
  EXPECT_EQ(normals[3], normals[2]);
}

TEST(RotationKeys, TakeTheShortWay) {
  const Quat q = Quat(-0.8, 0.6, 0, 0);
  const RotationKey first = rotation_key(q, nullptr), other = {0.6f, 0, 0, -0.8f};
  EXPECT_EQ(first, (RotationKey{-0.6f, 0, 0, 0.8f})) << "at first w >= 0";
  EXPECT_EQ(rotation_key(q, &first), first);
  EXPECT_EQ(rotation_key(q, &other), other);
}

}  // namespace
}  // namespace restage
