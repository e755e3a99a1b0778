// The chain's answer fitted to the cloud: nearer to what the cloud shows than the answer was.
#include "infer/registration/refinement.h"

#include <gtest/gtest.h>

#include "datasets/builtin/bodies.h"
#include "datasets/sampling/surface.h"
#include "infer/systems.h"
#include "tests/support/errors.h"
#include "tests/support/frames.h"
#include "tests/support/small_models.h"

namespace restage {
namespace {

const Body& person() {
  static const Body made = builtin_body(1, "test", 0);
  return made;
}

Mat3 turn(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

/// Arms lowered, a knee bent; `more`: limbs further by that, radians.
Pose standing(double more) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.local[16] = turn(-0.9 - more, Vec3::UnitZ());
  pose.local[17] = turn(0.9 - more, Vec3::UnitZ());
  pose.local[1] = turn(-0.4 + more, Vec3::UnitX());
  pose.local[4] = turn(0.5, Vec3::UnitX());
  pose.root = person().joints[0];
  return pose;
}

/// Answers every cloud with the same joints, about its centroid.
struct WrongBy final : SkeletonModel {
  Joints joints;
  SkeletonOutput forward(Context&, const SkeletonInput& in) override {
    const int64_t n = in.cloud.size(0);
    SkeletonOutput out;
    Tensor all = Tensor::empty({n, kJoints, 3});
    for (int64_t i = 0; i < n * kJoints; ++i)
      Eigen::Map<Point>(all.data<float>() + 3 * i) =
          joints[static_cast<size_t>(i % kJoints)].cast<float>();
    out.joints = Var(all);
    return out;
  }
  int64_t points() const override { return 256; }
  void visit(Fields&) override {}
  const char* kind() const override { return "WrongBy"; }
};

struct Scene {
  Points cloud;
  Joints truth;
  Bundle models;
};

/// A person and an extractor whose limbs are off by 0.3 radians.
Scene scene() {
  Scene out;
  const Pose pose = standing(0);
  out.cloud = SurfaceSampler(person()).draw(RngKey{5, 0}, 1500).on_pose(person(), pose);
  out.truth = forward_kinematics(person().joints, pose).joints;
  Point middle = Point::Zero();
  for (const Point& p : out.cloud) middle += p / static_cast<float>(out.cloud.size());
  auto extractor = std::make_shared<WrongBy>();
  extractor->joints = forward_kinematics(person().joints, standing(0.3)).joints;
  for (Vec3& j : extractor->joints) j -= middle.cast<double>();
  out.models = testing::untrained_bundle("motion/closed_form", {});
  TrainedModel model = out.models.need("skeleton", "test");
  model.net = extractor;
  out.models.put("skeleton", model);
  return out;
}

double mean_gap(const Joints& a, const Joints& b) {
  double sum = 0;
  for (size_t j = 0; j < kJoints; ++j) sum += (a[j] - b[j]).norm() / kJoints;
  return sum;
}

RetargetOptions plain_options(double fps = kFps) {
  RetargetOptions out;
  out.fps = fps;
  out.samples = 1;
  return out;
}

std::unique_ptr<Retargeter> chain(const Scene& s) {
  return std::make_unique<Retargeter>(s.models, "w", person().rest, person().joints,
                                      plain_options());
}

Refinement refinement(const Scene& s, double fps = kFps) {
  return Refinement("target", s.models, "w", person().rest, person().joints, plain_options(fps));
}

TEST(Refinement, BringsLimbsToWhereTheCloudIs) {
  const Scene s = scene();
  const Joints answer = *pushed(*chain(s), s.cloud, "cloud")[0].joints;
  Refinement refined = refinement(s);
  const RetargetedFrame frame = pushed(refined, s.cloud, "cloud")[0];
  EXPECT_GT(mean_gap(answer, s.truth), 0.03);
  EXPECT_LT(mean_gap(*frame.joints, s.truth), 0.5 * mean_gap(answer, s.truth));
  EXPECT_LT(mean_gap(*refined.source_joints(), s.truth), 0.5 * mean_gap(answer, s.truth));
  EXPECT_EQ(frame.vertices.size(), person().rest.vertices.size());
  EXPECT_NEAR((frame.pose.root - answer[0]).norm(), 0, 1e-9) << "the path is the chain's";
}

/// `copy` is the chain without a motion network, whatever motion network the weights hold.
TEST(CopySystem, IsTheChainWithTheClosedForm) {
  const Scene s = scene();
  const auto answer = [&](const std::string& system, const std::string& motion) {
    SystemInput in{s.models, "w", person().rest, "target", person().joints, {}};
    if (motion != "motion/closed_form")
      in.weights.put("motion", testing::untrained_bundle(motion).need("motion", "test"));
    in.options.samples = 1;
    return *pushed(*make_system(system_type(system), std::move(in)), s.cloud, "cloud")[0].joints;
  };
  const Joints copied = answer("copy", "smrm/rot6d");
  EXPECT_EQ(copied, answer("chain", "motion/closed_form"));
  EXPECT_NE(copied, answer("chain", "smrm/rot6d"));
}

TEST(Refinement, FramesOfAGapAreTheChains) {
  const Scene s = scene();
  Refinement refined = refinement(s);
  pushed(refined, s.cloud, "first");
  refined.miss();
  EXPECT_THROW(pushed(refined, Points(1000, Point(1, 2, 3)), "one place"), UnusableCloud);
  refined.miss();
  const auto frames = pushed(refined, s.cloud, "fourth");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_TRUE(frames[0].filled && frames[1].filled && !frames[2].filled);
  EXPECT_LT(mean_gap(*frames[2].joints, s.truth), 0.5 * mean_gap(*frames[1].joints, s.truth));
  refined.miss();
  EXPECT_EQ(finished(refined).size(), 1u);
}

TEST(Refinement, IsForCloudsThatAreAnsweredAtOnce) {
  const Scene s = scene();
  test::expect_error<InputError>([&] { refinement(s, 60); }, {"target", "30 frames per second"});
}

}  // namespace
}  // namespace restage
