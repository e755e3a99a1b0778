// Sides that an extractor confuses, and the memory that keeps them.
#include "nn/models/views.h"

#include <gtest/gtest.h>

#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_joints;

/// Somebody who faces `heading`, as an extractor with this log uncertainty sees it; with front and
/// back confused it has turned him round by exchanging the sides.
View seen(double heading, double log_uncertainty, bool confused = false) {
  View out;
  Joints joints = tiny_joints();
  joints[20] += Vec3(0, 0.3, 0.2);  // the left hand is raised
  for (size_t j = 0; j < kJoints; ++j) {
    const size_t from = confused ? static_cast<size_t>(kMirror[j]) : j;
    out.joints[j] = turn_about_y(heading) * joints[from];
    const Mat3 turn = turn_about_y(confused ? heading + M_PI : heading);
    out.turns[j] = turn.leftCols<2>();
    out.log_uncertainty[j] = log_uncertainty;
  }
  return out;
}

constexpr double kSure = -6, kUnsure = -3;  // 2.5 mm and 5 cm

SeenJoints answer(const std::vector<View>& views) {
  std::vector<double> values;
  return combined(views, true, true, "test", values);
}

SeenJoints remembered() {
  SeenJoints out = answer({seen(0.3, kSure)});
  remember_sides(nullptr, &out);
  return out;
}

double off(const View& view) {  // from what is true
  const View truth = seen(0.4, kSure);
  double worst = 0;
  for (size_t j = 0; j < kJoints; ++j) {
    worst = std::max(worst, (view.joints[j] - truth.joints[j]).norm());
    worst = std::max(worst, (view.turns[j] - truth.turns[j]).norm());
  }
  return worst;
}

TEST(Views, NineInTenErrorsAreWithinTheRadius) {
  std::array<double, kJoints> s;
  s.fill(0.02);
  const double r = radius_of_90(s)[21] / 0.02;  // of p(r) = r^2 exp(-r) / 2
  double held = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double x = r * (i + 0.5) / kSteps;
    held += x * x * std::exp(-x) / 2 * r / kSteps;
  }
  EXPECT_NEAR(held, 0.9, 1e-5);
}

TEST(Views, ConfusedSidesAreExchangedWhileTheExtractorIsUnsure) {
  SeenJoints before = remembered();
  ASSERT_TRUE(before.left);
  EXPECT_GT(before.left->dot(turn_about_y(0.3) * Vec3::UnitX()), 0.999);
  std::vector<View> views = {seen(0.4, kUnsure, true), seen(0.4, kUnsure),
                             seen(0.4, kUnsure, true)};
  EXPECT_GT(off(views[0]), 1);
  keep_sides(before, &views);
  for (const View& view : views) EXPECT_LT(off(view), 1e-12);
}

TEST(Views, SureAnswersAndOldMemoriesChangeNothing) {
  std::vector<View> sure = {seen(0.4, kSure, true)}, late = {seen(0.4, kUnsure, true)};
  SeenJoints before = remembered();
  keep_sides(before, &sure);
  EXPECT_GT(off(sure[0]), 1) << "who is sure may turn round";
  before.since = 15;
  keep_sides(before, &late);
  EXPECT_GT(off(late[0]), 1);
  keep_sides(SeenJoints(tiny_joints()), &late);  // never sure
  EXPECT_GT(off(late[0]), 1);
}

/// `view` with the names of some left joints and the right ones exchanged.
View renamed(View view, std::initializer_list<int> left) {
  for (const int l : left) {
    const auto a = static_cast<size_t>(l), b = static_cast<size_t>(kMirror[a]);
    std::swap(view.joints[a], view.joints[b]);
    std::swap(view.turns[a], view.turns[b]);
  }
  return view;
}

TEST(Views, LimbsOfSomeViewsGetTheirNamesBack) {
  const SeenJoints before = remembered();
  std::vector<View> views = {renamed(seen(0.4, kSure), {kLeftKnee, kLeftAnkle, kLeftFoot}),
                             seen(0.4, kSure), renamed(seen(0.4, kSure), {kLeftElbow, kLeftWrist})};
  EXPECT_EQ(keep_limbs(before, &views), (std::array<int, 2>{0, 0}));  // most views had them right
  for (const View& view : views) EXPECT_LT(off(view), 1e-12);
}

TEST(Views, WhatMostViewsSayForTwoSecondsIsBelieved) {
  SeenJoints before = remembered();
  for (int frame = 1; frame <= 60; ++frame) {
    std::vector<View> views(2, renamed(seen(0.4, kSure), {kLeftElbow, kLeftWrist}));
    before.exchanged = keep_limbs(before, &views);
    EXPECT_EQ(before.exchanged, (std::array<int, 2>{0, frame}));
    for (const View& view : views) EXPECT_LT(off(view), 1e-12) << frame;
  }
  std::vector<View> views(2, renamed(seen(0.4, kSure), {kLeftElbow, kLeftWrist}));
  EXPECT_EQ(keep_limbs(before, &views), (std::array<int, 2>{0, 0}));
  EXPECT_GT(off(views[0]), 0.1);
}

TEST(Views, WhatWasSureIsRememberedAndTurnsALittle) {
  const SeenJoints before = remembered();
  SeenJoints unsure = answer({seen(0.9, kUnsure)}), sure = answer({seen(0.9, kSure)});
  remember_sides(&before, &sure);
  EXPECT_EQ(sure.since, 0);
  EXPECT_GT(sure.left->dot(turn_about_y(0.9) * Vec3::UnitX()), 0.999);
  remember_sides(&before, &unsure);
  EXPECT_EQ(unsure.since, 1);
  const double turned = std::acos(unsure.left->dot(*before.left));
  EXPECT_GT(turned, 0.03);
  EXPECT_LT(turned, 0.1);
  SeenJoints nothing = answer({seen(0.9, kUnsure)});
  remember_sides(nullptr, &nothing);
  EXPECT_FALSE(nothing.left);
  const SeenJoints world = restage::turned(turn_about_y(1), before);
  EXPECT_LT((*world.left - turn_about_y(1) * *before.left).norm(), 1e-12);
}

}  // namespace
}  // namespace restage
