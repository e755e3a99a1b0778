// The door through which clouds of files, cameras and Python come to a system.
#include "datasets/doctor/cloud_door.h"

#include <gtest/gtest.h>

#include "nn/models/views.h"
#include "tests/support/doctor_people.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

TEST(CloudDoor, UnitsAxesAndStrayPoints) {
  const Points person = scan(somebody());
  Points given = person;
  for (Point& p : given) p = 1000 * Point(p.x(), -p.z(), p.y());
  given.push_back(Point(40'000, 3'000, -20'000));
  EXPECT_EQ(ToOurs(0.001, "z").clean(given), 1u);
  ASSERT_EQ(given.size(), person.size());
  for (size_t i = 0; i < person.size(); ++i) EXPECT_LT((given[i] - person[i]).norm(), 1e-5f);
}

/// The person, and somebody else a metre and a half in front.
Points two_people() {
  Points out = scan(somebody());
  for (const Point& p : scan(somebody(), nullptr, 0, 2)) out.push_back(p + Point(0.3f, 0, 1.5f));
  return out;
}

/// How many of these clouds the door lets pass.
int passing(CloudDoor& door, const Points& cloud, int count) {
  int out = 0;
  for (int k = 0; k < count; ++k) try {
      door.pass(cloud, "a cloud", [&] { ++out; });
    } catch (const InputError&) {
    }
  return out;
}

TEST(CloudDoor, LooksForASecondPersonAtFirstAndWhereSomebodyMayHaveCome) {
  CloudDoor live({}, false);
  EXPECT_EQ(passing(live, two_people(), 12), kSourceFrames - 1);
  CloudDoor looked_at({}, false, true);
  EXPECT_EQ(passing(looked_at, two_people(), 12), 12);
  const auto unusable = [] { throw UnusableCloud("a cloud", "shows nobody", "leave it out"); };
  EXPECT_THROW(looked_at.pass(scan(somebody()), "a cloud", unusable), UnusableCloud);
  EXPECT_EQ(passing(looked_at, two_people(), 12), kSourceFrames - 1);
  CloudDoor forced({}, true);
  EXPECT_EQ(passing(forced, two_people(), 12), 12);
}

TEST(CloudDoor, ACloudOfNoPersonsSizeIsMissed) {
  const Points large = moved(scan(somebody()), Mat3::Identity(), 100);
  CloudDoor door({}, false);
  EXPECT_THROW(door.pass(large, "a cloud", [] { ADD_FAILURE(); }), UnusableCloud);
  EXPECT_FALSE(door.hopeless());
  CloudDoor forced({}, true);
  EXPECT_EQ(passing(forced, large, 1), 1);
}

TEST(CloudDoor, ALyingSourceIsHopeless) {
  CloudDoor door({}, false);
  const Points lying =
      moved(scan(somebody()), Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()).toRotationMatrix());
  EXPECT_EQ(passing(door, lying, 9), kSourceFrames - 1);
  EXPECT_TRUE(door.hopeless());
}

}  // namespace
}  // namespace restage
