// Choices of a cloud's points: even, shared among views, the same in any order.
#include "nn/models/even_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "autograd/base/rng.h"

namespace restage {
namespace {

Points scattered(size_t n, uint64_t seed = 1) {
  Rng rng(RngKey{seed, 0});
  Points out;
  while (out.size() < n) {
    const auto number = [&] { return static_cast<float>(rng.uniform()); };
    const float x = number(), y = number();
    out.emplace_back(x, y, number());
  }
  return out;
}

Points chosen(const Points& cloud, size_t n, double offset) {
  EvenPoints points;
  points.arrange(cloud);
  Points out;
  points.choose(n, offset, &out);
  return out;
}

/// How often each point is in one of `views` choices of `n`.
std::map<std::array<float, 3>, int> shown(const Points& cloud, size_t n, int views, double start) {
  std::map<std::array<float, 3>, int> times;
  for (const Point& p : cloud) times[{p[0], p[1], p[2]}] = 0;
  for (int view = 0; view < views; ++view)
    for (const Point& p : chosen(cloud, n, (start + view) / views)) ++times.at({p[0], p[1], p[2]});
  return times;
}

Points grid() {  // each in a cell of its own
  Points out;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 4; ++k)
        out.emplace_back(0.025f * static_cast<float>(i), 0.025f * static_cast<float>(j),
                         0.025f * static_cast<float>(k));
  return out;
}

TEST(EvenPoints, ViewsShareThePointsAmongThem) {
  for (const double start : {0.001, 0.3, 0.99}) {
    for (const auto& [point, times] : shown(grid(), 64, 4, start)) EXPECT_EQ(times, 1) << start;
    for (const auto& [point, times] : shown(grid(), 128, 4, start)) EXPECT_EQ(times, 2) << start;
    for (const auto& [point, times] : shown(grid(), 512, 1, start)) EXPECT_EQ(times, 2) << start;
  }
}

TEST(EvenPoints, CrowdsInACellCountOnce) {
  Points cloud = grid();
  for (const Point& p : scattered(1000))
    cloud.push_back(Point(0.1f, 0.1f, 0.1f) + 0.002f * (p - Point(0.5f, 0.5f, 0.5f)));
  int crowd = 0;
  for (const Point& p : chosen(cloud, 128, 0.5))
    crowd += (p - Point(0.1f, 0.1f, 0.1f)).norm() < 0.01f;
  EXPECT_LE(crowd, 4);  // at most eight cells meet there, of 263
}

TEST(EvenPoints, ChoicesAreSpreadOverTheCloud) {
  // Of the points in the lower half of a cube a choice takes their share, nearer than chance does.
  const Points cloud = scattered(2000);
  const auto lower = [](const Points& of, int axis) {
    const auto low = [&](const Point& p) { return p[axis] < 0.5f; };
    return static_cast<double>(std::count_if(of.begin(), of.end(), low)) /
           static_cast<double>(of.size());
  };
  double even = 0, by_chance = 0;
  Rng rng(RngKey{4, 0});
  for (int i = 0; i < 60; ++i) {
    Points random;
    while (random.size() < 200) random.push_back(cloud[rng.below(cloud.size())]);
    even += std::abs(lower(chosen(cloud, 200, i / 60.0), i % 3) - lower(cloud, i % 3));
    by_chance += std::abs(lower(random, i % 3) - lower(cloud, i % 3));
  }
  EXPECT_LT(even, 0.75 * by_chance);
}

TEST(EvenPoints, OrderAndRepeatsDoNotMatter) {
  Points cloud = scattered(300);
  for (Point& p : cloud) p *= 0.05f;  // several in a cell
  Points other(cloud.rbegin(), cloud.rend());
  other.insert(other.begin(), 50, cloud[7]);
  EXPECT_EQ(chosen(cloud, 100, 0.25), chosen(other, 100, 0.25));
  EXPECT_NE(chosen(cloud, 100, 0.25), chosen(cloud, 100, 0.75));
  EvenPoints points;
  points.arrange(other);
  EXPECT_EQ(points.size(), 300u);
}

TEST(EvenPoints, FarApartAndFewAreTakenAsTheyAre) {
  const Points far = {Point(-3e38f, 0, 0), Point(3e38f, 0, 0), Point(0, 1e30f, -1e30f)};
  for (const double offset : {0.0, 0.999999}) EXPECT_EQ(chosen(far, 30, offset).size(), 30u);
  EvenPoints none;
  none.arrange({});
  EXPECT_EQ(none.size(), 0u);
}

}  // namespace
}  // namespace restage
