// A mesh that follows some of its vertices.
#include "nn/geometry/embedded_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/base/error.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

/// A bent sheet of 20 x 20 points, 1 cm apart.
Points sheet() {
  Points out;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) {
      const float x = 0.01f * static_cast<float>(i), y = 0.01f * static_cast<float>(j);
      out.emplace_back(x, y, 0.3f * x * y);
    }
  return out;
}

/// Every third point of it, in either direction.
std::vector<int32_t> nodes() {
  std::vector<int32_t> out;
  for (int i = 0; i < 20; i += 3)
    for (int j = 0; j < 20; j += 3) out.push_back(20 * i + j);
  return out;
}

Points of(const Points& points, const std::vector<int32_t>& which) {
  Points out;
  for (const int32_t i : which) out.push_back(points[static_cast<size_t>(i)]);
  return out;
}

TEST(EmbeddedMesh, ARigidMotionOfTheNodesIsOneOfTheMesh) {
  const Points rest = sheet();
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(2.2f, Point(0.2f, -0.7f, 0.4f).normalized()).toRotationMatrix();
  const auto moved = [&](Points p) {
    for (Point& x : p) x = turn * x + Point(1, -2, 0.5f);
    return p;
  };
  const Points made = EmbeddedMesh(rest, nodes())(moved(of(rest, nodes())));
  const Points truth = moved(rest);
  ASSERT_EQ(made.size(), truth.size());
  for (size_t i = 0; i < made.size(); ++i) EXPECT_LT((made[i] - truth[i]).norm(), 1e-5f) << i;
}

/// Bent by up to 109 degrees around a cylinder: nodes are exact, and what lies between them is
/// farther off where it does not turn with them.
TEST(EmbeddedMesh, FollowsABend) {
  const Points rest = sheet();
  const auto bent = [](Points p) {
    for (Point& x : p) {
      const float angle = x.x() / 0.1f, radius = 0.1f - x.z();
      x = Point(radius * std::sin(angle), x.y(), 0.1f - radius * std::cos(angle));
    }
    return p;
  };
  const Points moved = bent(of(rest, nodes())), truth = bent(rest);
  const EmbeddedMesh mesh(rest, nodes());
  const Points made = mesh(moved);
  for (size_t k = 0; k < moved.size(); ++k)
    EXPECT_EQ(made[static_cast<size_t>(nodes()[k])], moved[k]);
  float worst = 0;
  for (size_t i = 0; i < made.size(); ++i) worst = std::max(worst, (made[i] - truth[i]).norm());
  EXPECT_LT(worst, 0.006f);
  EXPECT_GT(worst, 0);
}

TEST(EmbeddedMesh, BitsDoNotDependOnThreads) {
  const Points rest = sheet();
  Points moved = of(rest, nodes());
  for (size_t k = 0; k < moved.size(); ++k) moved[k].z() += 0.01f * static_cast<float>(k % 5);
  const auto made = [&](int threads) {
    const testing::UseThreads use(threads);
    return EmbeddedMesh(rest, nodes())(moved);
  };
  EXPECT_EQ(made(1), made(3));
}

TEST(EmbeddedMesh, RefusesWhatItCannotFollow) {
  EXPECT_THROW(EmbeddedMesh(sheet(), {0, 1, 2, 3}), ShapeError);
  EXPECT_THROW(EmbeddedMesh(sheet(), {0, 1, 2, 3, 400}), ShapeError);
  EXPECT_THROW(EmbeddedMesh(sheet(), nodes())(sheet()), ShapeError);
}

}  // namespace
}  // namespace restage
