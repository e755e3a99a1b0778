#include "infer/registration/registration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/sampling/surface.h"
#include "nn/models/views.h"
#include "tests/support/frames.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

const Body& body() {
  static const Body made = builtin_body(1, "test", 0);
  return made;
}

/// Arms lowered, one step forwards, seen from another heading.
Pose step_pose(const Body& b) {
  const auto turn = [](double angle, const Vec3& axis) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.local[0] = turn(0.7, Vec3::UnitY());
  pose.local[16] = turn(-1.1, Vec3::UnitZ());
  pose.local[17] = turn(1.0, Vec3::UnitZ());
  pose.local[18] = turn(-0.5, Vec3::UnitY());
  pose.local[1] = turn(-0.5, Vec3::UnitX());
  pose.local[5] = turn(0.6, Vec3::UnitX());
  pose.root = b.joints[0] + Vec3(0.4, -0.03, -0.2);
  return pose;
}

/// 1,200 points of a posed surface with 3 mm of noise.
Points scan(const Body& b, const Pose& pose) {
  Points out = SurfaceSampler(b).draw(RngKey{5, 0}, 1200).on_pose(b, pose);
  add_noise(RngKey{6, 0}, 0.003, out);
  return out;
}

double mean_distance(const Joints& a, const Joints& b) {
  double sum = 0;
  for (size_t j = 0; j < a.size(); ++j) sum += (a[j] - b[j]).norm() / kJoints;
  return sum;
}

RetargetedFrame registered(const Body& target, const Points& cloud) {
  Registration registration(target.rest, target.joints, "target");
  return pushed(registration, cloud, "cloud")[0];
}

TEST(Registration, RecoversThePoseOfTheSameBody) {
  const Pose truth = step_pose(body());
  const PosedSkeleton posed = forward_kinematics(body().joints, truth);
  const RetargetedFrame found = registered(body(), scan(body(), truth));
  EXPECT_LT(mean_distance(*found.joints, posed.joints), 0.03);
  // It has somewhere to come from: the T-pose in the right place is far away.
  Joints rest = body().joints;
  for (Vec3& p : rest) p += truth.root - body().joints[0];
  EXPECT_GT(mean_distance(rest, posed.joints), 0.1);
  const Points surface = pose_surface(body(), truth);
  double sum = 0;
  for (size_t v = 0; v < surface.size(); ++v)
    sum += static_cast<double>((surface[v] - found.vertices[v]).norm());
  EXPECT_LT(sum / static_cast<double>(surface.size()), 0.05);
}

TEST(Registration, AnotherBodyPerformsItWithItsOwnBones) {
  const Body other = builtin_body(1, "test", 3);
  const Pose pose = step_pose(body());
  const RetargetedFrame found = registered(other, scan(body(), pose));
  ASSERT_EQ(found.vertices.size(), other.rest.vertices.size());
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    EXPECT_NEAR(((*found.joints)[j] - (*found.joints)[p]).norm(),
                (other.joints[j] - other.joints[p]).norm(), 1e-9);
  }
  Pose same = pose;  // the same turns, the path by the length of the legs
  same.root *= leg_length(other.joints) / leg_length(body().joints);
  EXPECT_LT(mean_distance(*found.joints, forward_kinematics(other.joints, same).joints), 0.08);
}

TEST(Registration, TheSameBitsForAnyNumberOfThreads) {
  const Points cloud = scan(body(), step_pose(body()));
  std::vector<RetargetedFrame> found;
  for (const int n : {1, 2, 3}) {
    const testing::UseThreads use(n);
    Registration registration(body().rest, body().joints, "target");
    pushed(registration, cloud, "first");
    found.push_back(pushed(registration, cloud, "second")[0]);  // with a frame before
  }
  for (size_t k = 1; k < found.size(); ++k)
    for (size_t v = 0; v < found[0].vertices.size(); ++v)
      ASSERT_EQ(found[k].vertices[v], found[0].vertices[v]) << v;
}

TEST(Registration, FreeFormFollowsWhatTheRigCannot) {
  const Rig rig = make_rig(body().rest, body().joints, "target");
  RigState state;
  state.pose.local.fill(Mat3::Identity());
  state.pose.root = body().joints[0];
  const PosedRig posed = pose_rig(rig, state);
  std::vector<Vec3> cloud;  // a belly: 4 cm to the front about the middle
  const auto bump = [](const Vec3& x) {
    return std::exp(-(x - body().joints[6]).squaredNorm() / 0.04);
  };
  for (const Point& p : body().rest.vertices) {
    const Vec3 x = p.cast<double>();
    cloud.push_back(x + Vec3(0, 0, 0.04 * bump(x)));
  }
  const std::vector<Vec3> moved = fit_free_form(rig, posed, cloud);
  double there = 0, wanted = 0, elsewhere = 0;
  int near = 0, far = 0;
  for (size_t i = 0; i < moved.size(); ++i) {
    const Vec3 shift = moved[i] - posed.nodes[i];
    const double share = bump(posed.nodes[i]);
    if (share > 0.5 && posed.normals[i].z() > 0.5) {
      there += shift.z();
      wanted += 0.04 * share;
      ++near;
    } else if (share < 0.01) {
      elsewhere += shift.norm();
      ++far;
    }
  }
  ASSERT_GT(near, 3);
  ASSERT_GT(far, 100);
  EXPECT_NEAR(there / near, wanted / near, 0.012);
  EXPECT_LT(elsewhere / far, 0.008);
  // The turns of the parts hardly change.
  const Pose refitted = refit_pose(rig, posed, moved);
  for (const Mat3& turn : refitted.local) EXPECT_LT(Eigen::AngleAxisd(turn).angle(), 0.1);
}

TEST(Registration, WeightsSumToOneAndBelongToTheNearestBone) {
  const SkinWeights w = bone_distance_weights(body().rest.vertices, body().joints);
  double agree = 0;
  for (Eigen::Index v = 0; v < w.rows(); ++v) {
    ASSERT_NEAR(w.row(v).sum(), 1.0f, 1e-5f);
    ASSERT_GE(w.row(v).minCoeff(), 0.0f);
    Eigen::Index mine, theirs;
    w.row(v).maxCoeff(&mine);
    body().weights.row(v).maxCoeff(&theirs);
    agree += mine == theirs;
  }
  EXPECT_GT(agree / static_cast<double>(w.rows()), 0.6);  // of the body's own weights
}

TEST(Registration, MissedFramesLieBetweenThoseAround) {
  const auto at = [](double way) {
    Pose pose = step_pose(body());
    pose.root.x() += way;
    return pose;
  };
  Registration registration(body().rest, body().joints, "target");
  registration.miss();
  const auto first = pushed(registration, scan(body(), at(0)), "first");
  ASSERT_EQ(first.size(), 2u) << "the missed one before is as the first";
  EXPECT_TRUE(first[0].filled && !first[1].filled);
  EXPECT_EQ(*first[0].joints, *first[1].joints);
  const Joints before = *first[1].joints;
  registration.miss();
  const auto second = pushed(registration, scan(body(), at(0.2)), "second");
  ASSERT_EQ(second.size(), 2u);
  EXPECT_TRUE(second[0].filled && !second[1].filled);
  EXPECT_EQ(second[0].vertices.size(), body().rest.vertices.size());
  const Joints after = *second[1].joints;
  EXPECT_LT(((*second[0].joints)[0] - (before[0] + after[0]) / 2).norm(), 1e-9);
  EXPECT_THROW(pushed(registration, {}, "none"), UnusableCloud);
  registration.miss();
  const auto last = finished(registration);
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(*last[0].joints, after);
  registration.restart();
  registration.miss();
  EXPECT_TRUE(finished(registration).empty());
}

TEST(Registration, FinishBeginsAnew) {
  Pose far = step_pose(body());
  far.local[0] = Mat3::Identity();
  far.root.z() += 0.5;
  const auto second = [&](Registration& registration) {
    registration.miss();
    const auto frames = pushed(registration, scan(body(), far), "second");
    return std::vector<Joints>{*frames[0].joints, *frames[1].joints};
  };
  Registration used(body().rest, body().joints, "target"), fresh(body().rest, body().joints, "it");
  pushed(used, scan(builtin_body(1, "test", 3), step_pose(builtin_body(1, "test", 3))), "first");
  used.miss();
  EXPECT_EQ(finished(used).size(), 1u);
  EXPECT_EQ(second(used), second(fresh));
}

TEST(Registration, OddInputsAreRefused) {
  const Points cloud = scan(body(), step_pose(body()));
  Registration registration(body().rest, body().joints, "target");
  EXPECT_THROW(pushed(registration, {}, "none"), InputError);
  EXPECT_THROW(pushed(registration, {cloud.begin(), cloud.begin() + 20}, "few"), InputError);
  EXPECT_THROW(pushed(registration, Points(1000, Point(1, 2, 3)), "one place"), InputError);
  for (const float wrong :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e38f}) {
    Points bad = cloud;
    bad[7].y() = wrong;
    EXPECT_THROW(pushed(registration, bad, "not finite"), InputError);
  }
  Mesh few{{cloud.begin(), cloud.begin() + 20}, {}};
  EXPECT_THROW(Registration(few, body().joints, "few"), InputError);
  EXPECT_THROW(Registration({}, body().joints, "none"), InputError);
  Joints rest = body().joints;
  rest[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Registration(body().rest, rest, "joints"), InputError);
}

}  // namespace
}  // namespace restage
