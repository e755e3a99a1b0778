// Several people in clouds: nobody is taken for another.
#include "datasets/doctor/people.h"

#include <gtest/gtest.h>

#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"

namespace restage {
namespace {

class PeopleTest : public ::testing::Test {
 protected:
  /// Two bodies that move, at these places.
  static Points shown(int who, size_t frame, float x, float z) {
    static const std::array<Body, 2> bodies = {builtin_body(1, "test", 0),
                                               builtin_body(1, "test", 1)};
    static const std::array<Motion, 2> motions = {builtin_motion(1, "test", 0),
                                                  builtin_motion(1, "test", 2)};
    const auto i = static_cast<size_t>(who);
    Pose pose = pose_on(motions[i], bodies[i], frame % motions[i].frames());
    pose.root.x() = x;
    pose.root.z() = z;
    const Points all = pose_surface(bodies[i], pose);
    Points out;
    for (size_t v = 0; v < all.size(); v += 5) out.push_back(all[v]);
    return out;
  }
  static Points joined(const Points& a, const Points& b) {
    Points out = a;
    out.insert(out.end(), b.begin(), b.end());
    return out;
  }
  /// Share of points that are among `mine`.
  static double share(const Points& found, const Points& mine) {
    size_t hits = 0;
    for (const Point& p : found) hits += std::find(mine.begin(), mine.end(), p) != mine.end();
    return static_cast<double>(hits) / static_cast<double>(std::max<size_t>(1, found.size()));
  }
};

TEST_F(PeopleTest, ApartEveryPointGoesToItsOwner) {
  PeopleTracker tracker;
  for (size_t f = 0; f < 60; ++f) {
    const float t = static_cast<float>(f) / 60;
    const Points a = shown(0, f, -1 + 2 * t, 0), b = shown(1, f, 1 - 2 * t, 1.6f);
    const auto found = tracker.follow(joined(a, b));
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].size(), a.size()) << f;
    EXPECT_EQ(share(found[0], a), 1) << f;
    EXPECT_EQ(share(found[1], b), 1) << f;
  }
}

TEST_F(PeopleTest, WhoTouchInPassingAreNotExchanged) {
  PeopleTracker tracker;
  std::vector<Points> found;
  Points a, b;
  for (size_t f = 0; f < 90; ++f) {
    const float t = static_cast<float>(f) / 89;
    a = shown(0, f, -1.5f + 3 * t, 0), b = shown(1, f, 1.5f - 3 * t, 0.45f);
    found = tracker.follow(joined(a, b));
    EXPECT_GT(share(found[0], a), 0.75) << f;
  }
  ASSERT_EQ(found.size(), 2u);
  EXPECT_GT(share(found[0], a), 0.99);
  EXPECT_GT(share(found[1], b), 0.99);
}

TEST_F(PeopleTest, WhoIsHiddenIsFoundAgainAndWhoComesIsNew) {
  PeopleTracker tracker;
  for (size_t f = 0; f < 50; ++f) {
    const float t = static_cast<float>(f) / 49;
    const Points a = shown(0, f, -1 + 2 * t, 0), b = shown(1, f, 1 - 2 * t, 1.5f);
    const bool hidden = f >= 20 && f < 32;
    Points cloud = hidden ? a : joined(a, b);
    if (f == 40) cloud = joined(cloud, shown(0, 0, 6, 6));
    const auto found = tracker.follow(cloud);
    EXPECT_EQ(share(found[0], a), 1) << f;
    EXPECT_EQ(share(found[1], b), hidden ? 0 : 1) << f;
    EXPECT_EQ(tracker.people(), f < 40 ? 2u : 3u) << f;
  }
}

TEST_F(PeopleTest, WhoIsHiddenByTheOneTouchedComesOutAgain) {
  for (const float side : {1.0f, -1.0f}) {
    PeopleTracker tracker;
    std::vector<Points> found;
    Points a, b;
    for (size_t f = 0; f < 110; ++f) {
      const float x = side * (-1.5f + 3 * static_cast<float>(f) / 109);
      a = shown(0, f, x, 0);
      b.clear();
      for (const Point& p : shown(1, f, -x, 0.3f))
        if (std::abs(p.x() - x) > 0.35f || (p.y() > 1 && std::abs(p.x() - x) > 0.2f))
          b.push_back(p);
      found = tracker.follow(joined(a, b));
      ASSERT_EQ(found.size(), 2u);
      const size_t own = found[side > 0 ? 1 : 0].size();
      EXPECT_LT(std::max(own, b.size()) - std::min(own, b.size()), 300u) << side << " " << f;
    }
    const size_t first = side > 0 ? 0 : 1;
    EXPECT_GT(share(found[first], a), 0.99) << side;
    EXPECT_EQ(found[first].size(), a.size()) << side;
    EXPECT_EQ(found[1 - first].size(), b.size()) << side;
  }
}

TEST_F(PeopleTest, EmptyCloudsAreNobody) {
  PeopleTracker tracker;
  EXPECT_TRUE(tracker.follow({}).empty());
  const Points a = shown(0, 0, 0, 0);
  EXPECT_EQ(tracker.follow(a).size(), 1u);
  EXPECT_TRUE(tracker.follow({})[0].empty());
  EXPECT_EQ(tracker.follow(a)[0].size(), a.size());
}

}  // namespace
}  // namespace restage
