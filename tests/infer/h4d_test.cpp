// H4D as a system: when it answers, where the target stands, gaps, what is refused.
#include "infer/h4d.h"

#include <gtest/gtest.h>

#include "datasets/sampling/code_spaces.h"
#include "datasets/sampling/code_windows.h"
#include "infer/systems.h"
#include "tests/support/errors.h"
#include "tests/support/frames.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

const Corpus& people() {
  static const Corpus out = subset(testing::tiny_corpus(), "train");
  return out;
}

/// Networks as they begin, with the body and the motions of the boxes; windows of six frames.
Bundle made_codes() {
  CodeWindowConfig windows;
  windows.frames = 6;
  windows.points = 48;
  const CodeWindowSampler sampler(people(), windows, {0}, 1);
  const LinearBody body = fit_linear_body(people().bodies, 10);
  const std::vector<Triangle>& faces = people().bodies[0].rest.faces;
  const MotionBasis basis = fit_motion_basis(sampler.poses(0, 30), 4, 6);
  H4dConfig c;
  c.hidden = c.features = c.recurrent = 16;
  c.shape = body.directions.size(2);
  c.pose = 3 * kJoints;
  c.frames = 6;
  c.root = basis.root.size(0);
  c.motion = c.root + basis.joints.size(0);
  c.vertices = body.mean.size(0);
  c.faces = std::ssize(faces);
  auto net = std::make_shared<H4d>(c, Init{RngKey{1, 0}});
  net->space.set(body, faces, basis);
  Bundle out;
  out.put("codes", {"codes/h4d", AnyConfig(c), net, {{"points", "48"}}});
  return out;
}

const Bundle& codes_of_boxes() {
  static const Bundle out = made_codes();
  return out;
}

const Body& boxes() { return people().bodies[1]; }

H4dSystem h4d_system(const RetargetOptions& options = {}) {
  return H4dSystem(codes_of_boxes(), "weights", boxes().rest, "target", {}, options);
}

/// Points on the body of boxes in a frame of its motion, moved by `by`.
Points boxes_in(size_t frame, const Point& by = Point::Zero()) {
  const Pose pose = pose_on(people().motions[0], boxes(), frame);
  Points out = pose_surface(boxes(), pose);
  for (Point& p : out) p += by;
  return out;
}

TEST(H4dSystem, AnswersTheFirstWindowAtOnceAndThenEveryCloud) {
  H4dSystem h4d = h4d_system();
  for (size_t f = 0; f < 5; ++f) EXPECT_TRUE(pushed(h4d, boxes_in(f), "a cloud").empty());
  EXPECT_EQ(pushed(h4d, boxes_in(5), "a cloud").size(), 6u);
  const auto frames = pushed(h4d, boxes_in(6), "a cloud");
  ASSERT_EQ(frames.size(), 1u);
  ASSERT_TRUE(frames[0].joints);
  EXPECT_EQ(frames[0].vertices.size(), boxes().rest.vertices.size());
  EXPECT_TRUE(finished(h4d).empty());
  for (size_t f = 0; f < 2; ++f) EXPECT_TRUE(pushed(h4d, boxes_in(f), "a cloud").empty());
  EXPECT_EQ(finished(h4d).size(), 2u);  // a source that ends before its first window
}

TEST(H4dSystem, StandsWhereTheSourceStandsInProportion) {
  H4dSystem here = h4d_system(), there = h4d_system();
  const Point by(2, 0, -3);
  for (size_t f = 0; f < 5; ++f)
    pushed(here, boxes_in(f), "a cloud"), pushed(there, boxes_in(f, by), "it");
  const auto a = pushed(here, boxes_in(5), "a cloud"),
             b = pushed(there, boxes_in(5, by), "a cloud");
  ASSERT_EQ(a.size(), b.size());
  for (size_t f = 0; f < a.size(); ++f) {
    const Vec3 moved = b[f].pose.root - a[f].pose.root;
    EXPECT_NEAR(moved.y(), 0, 1e-3);
    EXPECT_NEAR(moved.x() / moved.z(), -2.0 / 3, 1e-3);
    EXPECT_GT(moved.x(), 1);  // as long as its legs are beside the source's
    EXPECT_LT(moved.x(), 4);
  }
}

TEST(H4dSystem, GapsAreFilledBetweenTheirEnds) {
  H4dSystem h4d = h4d_system();
  h4d.miss();
  for (size_t f = 0; f < 5; ++f) pushed(h4d, boxes_in(f), "a cloud");
  const auto first = pushed(h4d, boxes_in(5), "a cloud");
  ASSERT_EQ(first.size(), 7u);
  EXPECT_TRUE(first[0].filled);
  EXPECT_EQ(first[0].vertices[0], first[1].vertices[0]);
  const Vec3 from = first[6].pose.root;
  h4d.miss();
  const auto next = pushed(h4d, boxes_in(7), "a cloud");
  ASSERT_EQ(next.size(), 2u);
  EXPECT_TRUE(next[0].filled);
  EXPECT_LT((next[0].pose.root - 0.5 * (from + next[1].pose.root)).norm(), 1e-6);
  h4d.miss();
  EXPECT_EQ(finished(h4d).size(), 1u);
}

/// The middle that needs no vertex is that of the posed vertices.
TEST(H4dSystem, KnowsTheMiddleOfAPosedBody) {
  const H4d& net = codes_of_boxes().need_as<H4d>("codes", "");
  ShapedSkeleton skeleton(net.space);
  const Eigen::VectorXd shape = Eigen::Vector2d(0.4, -0.7);
  skeleton.take(shape);
  Tensor turns = Tensor::zeros({1, 1, 66});
  Pose pose;
  for (size_t j = 0; j < kJoints; ++j) {
    const Vec3 turn = 0.3 * Vec3(std::sin(1.0 * j), std::cos(2.0 * j), std::sin(3.0 * j));
    Eigen::Map<Point>(turns.data<float>() + 3 * j) = turn.cast<float>();
    pose.local[j] = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  pose.root = skeleton.rest()[0];
  const Var code(Tensor::from<float>({1, 2}, {0.4f, -0.7f}));
  const LinearBody body = net.space.body();
  const Tensor posed = pose_body(body, code, Var(turns)).value;
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const Triangle& f : net.space.faces()) {  // areas of the mean body at rest
    Vec3 rest[3], now = Vec3::Zero();
    for (size_t c = 0; c < 3; ++c) {
      rest[c] = Eigen::Map<const Point>(body.mean.data<float>() + 3 * f[c]).cast<double>();
      now += Eigen::Map<const Point>(posed.data<float>() + 3 * f[c]).cast<double>() / 3;
    }
    const double size = (rest[1] - rest[0]).cross(rest[2] - rest[0]).norm();
    area += size;
    sum += size * now;
  }
  const Vec3 said = skeleton.middle(forward_kinematics(skeleton.rest(), pose));
  EXPECT_LT((said - sum / area).norm(), 1e-5);
}

TEST(H4dSystem, TakesTheTargetsJointsWhereTheyAreKnown) {
  const SystemType& type = system_type("h4d");
  SystemInput in{codes_of_boxes(), "weights", boxes().rest, "target", boxes().joints, {}};
  const auto known = type.make(std::move(in));
  EXPECT_EQ((*known->target_joints())[5], boxes().joints[5]);
  ASSERT_NE(known->rig(), nullptr);
  Pose rest;
  rest.local.fill(Mat3::Identity());
  rest.root = boxes().joints[0];
  const Points posed = known->posed(rest);
  for (size_t i = 0; i < posed.size(); ++i)
    EXPECT_LT((posed[i] - boxes().rest.vertices[i]).norm(), 1e-5f);
}

TEST(H4dSystem, RefusesWhatItCannotUse) {
  const auto refused = [](const auto& f) { return test::refusal_of(f); };
  RetargetOptions fast;
  fast.fps = 60;
  for (const char* system : {"h4d", "transfer", "register"}) {
    SystemInput input;
    input.options = fast;
    EXPECT_HAS(refused([&] { make_system(system_type(system), std::move(input)); }),
               "60 frames a second");
  }
  EXPECT_HAS(refused([&] { H4dSystem(codes_of_boxes(), "weights", {}, "target", {}, {}); }),
             "no vertices");
  EXPECT_HAS(refused([&] { H4dSystem({}, "weights", boxes().rest, "target", {}, {}); }), "codes");
  Bundle bare;
  const AnyConfig sizes = model_config("codes/h4d", {"hidden=4", "features=4", "recurrent=4"});
  bare.put("codes", {"codes/h4d", sizes, make_model("codes/h4d", sizes, Init{RngKey{1, 0}}), {}});
  EXPECT_HAS(refused([&] { H4dSystem(bare, "weights", boxes().rest, "target", {}, {}); }),
             "without a body");
  H4dSystem h4d = h4d_system();
  EXPECT_HAS(refused([&] { pushed(h4d, Points(3), "three"); }), "three");
}

}  // namespace
}  // namespace restage
