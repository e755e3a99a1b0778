#include "infer/retargeter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "autograd/ops/elementwise.h"
#include "tests/infer/retargeter_support.h"
#include "tests/support/errors.h"
#include "tests/support/fake_device.h"

namespace restage {
namespace {

using namespace retargeter_test;
using testing::tiny_joints;

/// Answers with the joints that it was given, at the centroid of the cloud.
struct FixedExtractor final : SkeletonModel {
  Joints joints = tiny_joints();
  SkeletonOutput forward(Context&, const SkeletonInput& in) override {
    const int64_t n = in.cloud.size(0);
    Tensor out = Tensor::empty({n, kJoints, 3});
    for (int64_t i = 0; i < n * kJoints; ++i) {
      const int j = static_cast<int>(i % kJoints);
      const bool mirrored = i / kJoints % 2 == 1;  // every second view is
      Point p = joints[mirrored ? kMirror[j] : j].cast<float>();
      if (mirrored) p.x() = -p.x();
      Eigen::Map<Point>(out.data<float>() + 3 * i) = p;
    }
    SkeletonOutput result;
    result.joints = Var(out);
    return result;
  }
  int64_t points() const override { return 128; }
  void visit(Fields&) override {}
  const char* kind() const override { return "Fixed"; }
};

TEST(InferRetargeter, BeginsWhereItCanSee) {
  const auto source = performance(6);
  std::vector<SeenJoints> seen(source.begin(), source.end());
  for (size_t f = 0; f < seen.size(); ++f) {
    seen[f].uncertainty.emplace().fill(f < 2 ? 0.2 : 0.002);
    if (f < 2)
      for (Vec3& joint : seen[f].joints) joint = joint * 0.3 + Vec3(2, 0, 0);  // half of somebody
  }
  Retargeter r(untrained(), "w", target().rest, target().joints, {.anchor = 0, .foot_lock = false});
  Retargeter clear(untrained(), "w", target().rest, target().joints,
                   {.anchor = 0, .foot_lock = false});
  for (size_t f = 0; f < seen.size(); ++f) {
    const Vec3 at = pushed_joints(r, seen[f])[0].pose.root;
    if (f < 2) {
      EXPECT_GT((at - pushed_joints(clear, seen[2])[0].pose.root).norm(), 0.5);
      clear.restart();
    } else if (f == 2) {
      EXPECT_LT((at - pushed_joints(clear, seen[2])[0].pose.root).norm(), 0.05);
    }
  }
}

TEST(InferRetargeter, WaitsWhereItDoubts) {
  constexpr size_t kReturn = kReturnFrames, kDoubt = 2 + kReturn + 3,
                   kFrames = kDoubt + kReturn + 4;
  const auto source = performance(kFrames);
  std::vector<SeenJoints> seen(source.begin(), source.end());
  const auto doubted = [&](size_t f) { return f < 2 || f == kDoubt || f == kDoubt + 1; };
  for (size_t f = 0; f < seen.size(); ++f)
    seen[f].uncertainty.emplace().fill(doubted(f) ? 0.2 : 0.002);
  const auto frames = [&](double least) {
    Retargeter r(untrained(), "w", target().rest, target().joints, {.min_confidence = least});
    std::vector<RetargetedFrame> out;
    for (const SeenJoints& s : seen) out.push_back(pushed_joints(r, s)[0]);
    return out;
  };
  const auto answered = frames(0), held = frames(0.5);
  EXPECT_GT(*answered[3].confidence, 0.99);
  EXPECT_LT(*answered[kDoubt].confidence, 0.1);
  for (const Mat3& r : held[1].pose.local) EXPECT_NEAR(r.col(1).y(), 1, 1e-9) << "stands at rest";
  EXPECT_GT(apart(*answered[kDoubt].joints, *answered[kDoubt - 1].joints), 1e-4);
  const auto step = [](const std::vector<RetargetedFrame>& of, size_t f) {
    return apart(*of[f].joints, *of[f - 1].joints);
  };
  double jump = 0;  // from rest into the motion
  for (size_t f = 2; f < kFrames; ++f) {
    if (doubted(f)) {
      EXPECT_EQ(apart(*held[f].joints, *answered[kDoubt - 1].joints), 0) << f;
    } else if ((f >= 2 + kReturn && f < kDoubt) || f >= kDoubt + 2 + kReturn) {
      EXPECT_EQ(apart(*held[f].joints, *answered[f].joints), 0) << f << ": has come back";
    }
    jump = std::max(jump, step(held, f));
  }
  EXPECT_GT(apart(*held[1].joints, *answered[2].joints), 0.2);
  EXPECT_LT(jump, 0.5 * apart(*held[1].joints, *answered[2].joints)) << "no jump";
  EXPECT_LT(step(held, 2), 0.05 * apart(*held[1].joints, *answered[2].joints));
  Retargeter silent(untrained(), "w", target().rest, target().joints, {.min_confidence = 0.5});
  EXPECT_THROW(pushed_joints(silent, source[0]), InputError);
}

/// The whole sequence in one forward pass of the network, velocities in the world's directions.
std::vector<Pose> whole_sequence(const Bundle& models, const std::vector<Joints>& source) {
  const auto frames = static_cast<int64_t>(source.size());
  Tensor joints = Tensor::zeros({1, frames, kJoints, 3}), trans = Tensor::zeros({1, frames, 3});
  Tensor rest = Tensor::zeros({1, kJoints, 3});
  for (size_t f = 0; f < source.size(); ++f)
    for (size_t c = 0; c < 3; ++c) {
      for (size_t j = 0; j < kJoints; ++j)
        joints.data<float>()[(f * kJoints + j) * 3 + c] =
            static_cast<float>(source[f][j][c] - source[f][0][c]);
      if (f > 0)
        trans.data<float>()[3 * f + c] =
            static_cast<float>(kFps * (source[f][0][c] - source[f - 1][0][c]));
    }
  for (size_t j = 0; j < kJoints; ++j)
    for (size_t c = 0; c < 3; ++c)
      rest.data<float>()[3 * j + c] =
          static_cast<float>(target().joints[j][c] - target().joints[0][c]);
  Context ctx;
  MotionState state;
  const MotionOutput out = models.need_as<MotionModel>("motion", "test")
                               .forward(ctx, {Var(joints), Var(trans), Var(rest), {}, {}}, &state);
  std::vector<Pose> poses(source.size());
  Vec3 root = leg_length(target().joints) / leg_length(source[0]) * source[0][0];
  for (size_t f = 0; f < source.size(); ++f) {
    const float* t = out.trans.value.data<float>() + 3 * f;
    if (f > 0) root += Vec3(t[0], t[1], t[2]) / kFps;
    poses[f].root = root;
    for (size_t j = 0; j < kJoints; ++j)
      poses[f].local[j] =
          matrix_at(out.rotations.value.data<float>() + (f * kJoints + j) * 9).cast<double>();
  }
  return poses;
}

TEST(InferRetargeter, FrameByFrameEqualsTheWholeSequence) {
  for (const std::string name : {"smrm/rot6d", "smrm/quaternion"}) {
    const Bundle models = untrained(name);
    const std::vector<Joints> source = performance(40);
    Retargeter r(models, "w", target().rest, target().joints, {.anchor = 0});
    const std::vector<RetargetedFrame> online = run(r, source);
    const std::vector<Pose> whole = whole_sequence(models, source);
    ASSERT_EQ(online.size(), whole.size());
    for (size_t f = 0; f < whole.size(); ++f) {
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_LT((online[f].pose.local[j] - whole[f].local[j]).cwiseAbs().maxCoeff(), 1e-5)
            << name << " frame " << f;
      EXPECT_LT((online[f].pose.root - whole[f].root).norm(), 1e-5) << name << " frame " << f;
      EXPECT_LT(apart(*online[f].joints, forward_kinematics(target().joints, whole[f]).joints),
                1e-5);
    }
    // The state is carried: a frame depends on those before it.
    r.restart();
    EXPECT_GT(apart(*pushed_joints(r, source[20])[0].joints, *online[20].joints), 1e-4);
  }
}

TEST(InferRetargeter, TheAnchorBoundsDriftAndLeavesThePoseAlone) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(120);
  const double scale = leg_length(target().joints) / leg_length(source[0]), seconds = 0.25;
  const std::vector<RetargetedFrame> far = retargeted(models, source, {.anchor = 0}),
                                     near = retargeted(models, source, {.anchor = seconds});
  const auto off = [&](const RetargetedFrame& frame, size_t f) {
    return Vec3(frame.pose.root - scale * source[f][0]);
  };
  double fastest = 0, most = 0;  // metres a second, metres
  for (size_t f = 1; f < source.size(); ++f) {
    fastest = std::max(fastest, kFps * (off(far[f], f) - off(far[f - 1], f - 1)).norm());
    most = std::max(most, off(near[f], f).norm());
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_EQ(near[f].pose.local[j], far[f].pose.local[j]) << f << " " << j;
  }
  EXPECT_LT(off(near[0], 0).norm(), 1e-9);
  EXPECT_GT(fastest, 1e-3) << "an untrained network is wrong";
  EXPECT_LE(most, seconds * fastest * 1.01);
  EXPECT_LT(off(near.back(), 119).norm(), 0.5 * off(far.back(), 119).norm());
}

TEST(InferRetargeter, LegsThatSeemToGrowMoveNobodyWhoIsFarAway) {
  const Bundle models = untrained();
  const auto way = [&](double away) {  // of B in two seconds, A growing by 2 %
    std::vector<Joints> source(60, performance(1)[0]);
    for (size_t f = 0; f < source.size(); ++f)
      for (Vec3& x : source[f]) x = (1 + 0.02 * static_cast<double>(f) / 60) * x + Vec3(away, 0, 0);
    const std::vector<RetargetedFrame> out = retargeted(models, source);
    return Vec3(out.back().pose.root - out.front().pose.root);
  };
  EXPECT_LT((way(1000) - way(0)).norm(), 0.02 * 3);
}

TEST(InferRetargeter, RestartForgetsEverything) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(12);
  Retargeter r(models, "w", target().rest, target().joints, {});
  const std::vector<RetargetedFrame> first = run(r, source);
  r.restart();
  const std::vector<RetargetedFrame> again = run(r, source);
  ASSERT_EQ(first.size(), again.size());
  for (size_t f = 0; f < first.size(); ++f) {
    EXPECT_EQ(*first[f].joints, *again[f].joints);
    EXPECT_EQ(first[f].vertices, again[f].vertices);
  }
}

TEST(InferRetargeter, MemoryDoesNotGrowWithTheFrames) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(100);
  Retargeter r(models, "w", target().rest, target().joints, {});
  for (int i = 0; i < 5; ++i) pushed_joints(r, source[0]);
  reset_peak_memory();
  for (int i = 0; i < 5; ++i) pushed_joints(r, source[1]);
  const MemoryStats before = memory_stats();
  for (const Joints& j : source) pushed_joints(r, j);
  const MemoryStats after = memory_stats();
  EXPECT_EQ(after.peak, before.peak);
  EXPECT_EQ(after.in_use, before.in_use);
  EXPECT_EQ(after.large_allocations, before.large_allocations);
}

TEST(InferRetargeter, WhoLooksAheadAnswersEveryFrameLater) {
  const auto with = [](int64_t latency) {
    return testing::with_setting(
        testing::untrained_bundle("smrm/hybrid",
                                  {"hidden=8", "latency=" + std::to_string(latency)}),
        "motion", "remove_heading", "true");
  };
  for (const size_t length : {1u, 2u, 3u, 12u}) {
    const auto source = performance(length);
    const auto at_once = retargeted(with(0), source);
    Retargeter late(with(3), "w", target().rest, target().joints, {});
    for (const int round : {0, 1}) {
      std::vector<RetargetedFrame> frames = run(late, source);
      EXPECT_EQ(frames.size(), length > 3 ? length - 3 : 0);
      for (const RetargetedFrame& f : finished(late)) frames.push_back(f);
      ASSERT_EQ(frames.size(), length) << round;
      for (size_t f = 0; f < length; ++f)
        EXPECT_LT(apart(*frames[f].joints, *at_once[f].joints), 0.03) << length << " " << f;
      late.restart();
    }
  }
}

TEST(InferRetargeter, FramesOfOtherRatesFallOnTheThirtyPerSecondGrid) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(40);
  const auto frames = [&](double fps, size_t n) {
    return retargeted(models, {source.begin(), source.begin() + static_cast<std::ptrdiff_t>(n)},
                      {.fps = fps});
  };
  EXPECT_EQ(frames(30, 40).size(), 40u);
  EXPECT_EQ(frames(60, 40).size(), 20u);
  EXPECT_EQ(frames(15, 20).size(), 39u);  // the last one has no successor to lie between
  EXPECT_EQ(frames(120, 40).size(), 10u);
  EXPECT_EQ(frames(24, 25).size(), 31u);  // one second and its end
  EXPECT_EQ(frames(29.97, 40).size(), 40u);

  // Every second frame of 60 is a frame of 30; halves of 15 are midpoints.
  std::vector<Joints> half, doubled;
  for (size_t f = 0; f < 40; f += 2) half.push_back(source[f]);
  for (size_t f = 0; f < 20; ++f) {
    doubled.push_back(source[f]);
    Joints middle;
    for (size_t j = 0; j < kJoints; ++j) middle[j] = (source[f][j] + source[f + 1][j]) / 2;
    if (f < 19) doubled.push_back(middle);
  }
  const auto from60 = frames(60, 40), direct = retargeted(models, half);
  const auto from15 = frames(15, 20), midpoints = retargeted(models, doubled);
  for (size_t f = 0; f < direct.size(); ++f)
    EXPECT_LT(apart(*from60[f].joints, *direct[f].joints), 1e-6) << f;
  for (size_t f = 0; f < midpoints.size(); ++f)
    EXPECT_LT(apart(*from15[f].joints, *midpoints[f].joints), 1e-5) << f;
}

TEST(InferRetargeter, VerticesKeepTheTargetsOrder) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(3);
  Mesh turned = target().rest;
  std::reverse(turned.vertices.begin(), turned.vertices.end());
  const auto n = static_cast<int>(turned.vertices.size());
  for (Triangle& t : turned.faces)
    for (int& i : t) i = n - 1 - i;
  Retargeter a(models, "w", target().rest, target().joints, {}),
      b(models, "w", turned, target().joints, {});
  EXPECT_EQ(b.target().faces, turned.faces);
  ASSERT_EQ(a.rig()->weights.rows(), n);
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(a.rig()->weights.row(i).sum(), 1.0f, 1e-5f);
    EXPECT_LT((a.rig()->weights.row(i) - b.rig()->weights.row(n - 1 - i)).cwiseAbs().maxCoeff(),
              1e-5f);
  }
  for (const Joints& j : source) {
    const Points x = pushed_joints(a, j)[0].vertices;
    Points y = pushed_joints(b, j)[0].vertices;
    std::reverse(y.begin(), y.end());
    EXPECT_LT(apart(x, y), 1e-5);
  }
}

TEST(InferRetargeter, TargetsAwayFromTheOriginAreTheSame) {
  const Bundle models = untrained();
  const std::vector<Joints> source = performance(4);
  Mesh moved = target().rest;
  for (Point& p : moved.vertices) p += Point(2, 0.5f, -3);
  Joints rest = target().joints;
  for (Vec3& j : rest) j += Vec3(2, 0.5, -3);
  Retargeter a(models, "w", target().rest, target().joints, {}), b(models, "w", moved, rest, {});
  for (const Joints& j : source) {
    const RetargetedFrame x = pushed_joints(a, j)[0], y = pushed_joints(b, j)[0];
    EXPECT_LT(apart(*x.joints, *y.joints), 1e-4);
    EXPECT_LT(apart(x.vertices, y.vertices), 1e-4);
  }
}

TEST(InferRetargeter, UnknownSettingsAreRefused) {
  const Bundle models = testing::with_setting(untrained(), "motion", "translation", "sideways");
  EXPECT_THROW(Retargeter(models, "w", target().rest, target().joints, {}), InputError);
}

/// The skeleton moves without a surface, for who has trained no deformation.
TEST(InferRetargeter, WithoutDeformationThereAreJointsOnly) {
  Bundle models = untrained();
  models.erase("deformation.weights");
  Retargeter r(models, "w", target().rest, target().joints, {});
  const auto frames = run(r, performance(2));
  EXPECT_TRUE(frames[1].vertices.empty());
  EXPECT_EQ(r.rig(), nullptr);
  models.erase("motion");
  EXPECT_THROW(Retargeter(models, "w", target().rest, target().joints, {}), InputError);
}

TEST(InferRetargeter, RestPoseIsTheTargetItselfWithoutOffsets) {
  Bundle models = untrained();
  models.erase("deformation.offsets");
  const Retargeter r(models, "w", target().rest, target().joints, {});
  Pose pose;
  for (Mat3& m : pose.local) m.setIdentity();
  pose.root = target().joints[0];
  EXPECT_LT(apart((*r.surface())(pose), target().rest.vertices), 1e-5);
  pose.root += Vec3(1, 2, 3);
  Points there = target().rest.vertices;
  for (Point& p : there) p += Point(1, 2, 3);
  EXPECT_LT(apart((*r.surface())(pose), there), 1e-5);
}

/// Every meaning of the translation starts B at A's place in proportion to its legs, or says where
/// it is.
TEST(InferRetargeter, TranslationsMeanWhatTheWeightsSay) {
  const std::vector<Joints> source = performance(6);
  std::vector<Joints> elsewhere = source;
  const Vec3 step(3, 0, -2);
  for (Joints& joints : elsewhere)
    for (Vec3& j : joints) j += step;
  for (const std::string kind : {"velocity", "relative", "absolute"}) {
    const Bundle models = testing::with_setting(untrained(), "motion", "translation", kind);
    const auto x = retargeted(models, source), y = retargeted(models, elsewhere);
    const double ratio = leg_length(target().joints) / leg_length(source[0]);
    if (kind == "velocity") {
      EXPECT_LT((x[0].pose.root - ratio * source[0][0]).norm(), 1e-5);
    }
    // Only the absolute path lets the network know where A is.
    for (size_t f = 0; f < x.size(); ++f) {
      const double rotation = (x[f].pose.local[5] - y[f].pose.local[5]).norm();
      const double place = (y[f].pose.root - x[f].pose.root - ratio * step).norm();
      if (kind == "absolute") {
        EXPECT_GT(rotation, 1e-4) << f;
      } else {
        EXPECT_LT(rotation, 1e-5) << kind << " " << f;
        EXPECT_LT(place, 1e-4) << kind << " " << f;
      }
    }
  }
}

TEST(InferRetargeter, WithoutHeadingTheResultTurnsWithTheSource) {
  const Bundle models = testing::with_setting(untrained(), "motion", "remove_heading", "true");
  const std::vector<Joints> source = performance(8);
  std::vector<Joints> turned = source;
  const Mat3 turn = turn_about_y(1.1);
  for (Joints& joints : turned)
    for (Vec3& j : joints) j = turn * j;
  const auto x = retargeted(models, source), y = retargeted(models, turned);
  for (size_t f = 0; f < x.size(); ++f) {
    Joints expected = *x[f].joints;
    for (Vec3& j : expected) j = turn * j;
    EXPECT_LT(apart(*y[f].joints, expected), 1e-4) << f;
  }
}

Bundle with_extractor(const Joints& joints) {
  Bundle models = untrained();
  auto fixed = std::make_unique<FixedExtractor>();
  fixed->joints = joints;
  TrainedModel model = models.need("skeleton", "test");
  model.net = std::move(fixed);
  models.put("skeleton", std::move(model));
  return models;
}

/// Rest joints whose arms hang by `degrees`, to the left or on both sides.
Joints arms_down(double degrees, bool both) {
  Joints joints = tiny_joints();
  for (const auto& [shoulder, sign] : {std::pair<size_t, double>{16, -1.0}, {17, 1.0}}) {
    if (sign > 0 && !both) continue;
    const Mat3 turn =
        Eigen::AngleAxisd(sign * degrees * M_PI / 180, Vec3::UnitZ()).toRotationMatrix();
    for (const size_t j : {shoulder + 2, shoulder + 4}) {
      const Vec3 along(joints[j].x() - joints[shoulder].x(), 0, 0);
      joints[j] = joints[shoulder] + turn * along;
    }
  }
  return joints;
}

TEST(InferRetargeter, TargetsThatAreNoTPose) {
  const auto refused = [&](const Joints& joints) {
    const Bundle models = with_extractor(joints);
    EXPECT_NO_THROW(Retargeter(models, "w", target().rest, "hero.obj", {.force = true}));
    const std::string said =
        test::refusal_of([&] { Retargeter(models, "w", target().rest, "hero.obj", {}); });
    if (!said.empty()) {
      EXPECT_TRUE(said.starts_with("hero.obj: is not in T-pose")) << said;
      EXPECT_HAS(said, "force");
    }
    return !said.empty();
  };
  EXPECT_FALSE(refused(arms_down(0, true)));
  EXPECT_FALSE(refused(arms_down(29, true)));
  EXPECT_FALSE(refused(arms_down(-29, true)));
  EXPECT_TRUE(refused(arms_down(31, true)));
  EXPECT_TRUE(refused(arms_down(31, false)));  // one arm is enough
  EXPECT_TRUE(refused(arms_down(90, true)));
  Joints behind = tiny_joints();
  for (Vec3& j : behind) j = turn_about_y(M_PI) * j;  // facing -z: left is on the right
  EXPECT_TRUE(refused(behind));
  Joints none = tiny_joints();
  none[20] = none[16];
  EXPECT_TRUE(refused(none));
}

TEST(InferRetargeter, WhatCannotBeAnsweredIsSaid) {
  const Bundle models = untrained();
  for (const double fps : {0.0, -30.0, 0.01, 1e9, std::nan("")})
    EXPECT_THROW(retargeted(models, {}, {.fps = fps}), InputError) << fps;
  Retargeter r(models, "w", target().rest, target().joints, {});
  Joints huge = tiny_joints();
  for (Vec3& j : huge) j *= 1e60;
  EXPECT_THROW(pushed_joints(r, huge), InputError);
}

TEST(InferRetargeter, CloudsGoThroughTheExtractor) {
  Bundle models = untrained();
  const RetargetOptions options{.force = true, .samples = 2};
  Retargeter a(models, "w", target().rest, "hero.obj", options),
      b(models, "w", target().rest, "hero.obj", options);
  EXPECT_EQ(a.rest(), b.rest());
  for (uint64_t f = 0; f < 4; ++f) {
    Points cloud = surface_points(target().rest, 300 + 20 * f, RngKey{f, 0});
    const auto x = pushed(a, cloud, "f0.ply");
    std::reverse(cloud.begin(), cloud.end());
    const auto y = pushed(b, cloud, "f0.ply");
    ASSERT_EQ(x.size(), 1u);
    EXPECT_EQ(x[0].joints, y[0].joints);
    EXPECT_EQ(x[0].vertices, y[0].vertices);
    EXPECT_EQ(x[0].vertices.size(), target().rest.vertices.size());
    EXPECT_EQ(*a.source_joints(), *b.source_joints());
  }
  // A cloud that cannot be used leaves everything as it was.
  EXPECT_THROW(pushed(a, Points(3, Point(0, 0, 0)), "f1.ply"), UnusableCloud);
  const Points next = surface_points(target().rest, 300, RngKey{9, 0});
  EXPECT_EQ(pushed(a, next, "f2.ply")[0].joints, pushed(b, next, "f2.ply")[0].joints);
}

TEST(Retargeter, NetworksOnAnotherDeviceAnswerAlike) {
  const auto frames = [](Device device) {
    const Bundle models = testing::untrained_bundle("smrm/hybrid", {"hidden=16", "contact=true"});
    move_networks(models, {"skeleton", "motion"}, device);
    Retargeter r(models, "w", target().rest, target().joints, {.samples = 2});
    std::vector<RetargetedFrame> out;
    for (int f = 0; f < 3; ++f) {
      Points cloud = surface_points(target().rest, 300, RngKey{3, static_cast<uint64_t>(f)});
      for (const RetargetedFrame& frame : pushed(r, cloud, "cloud")) out.push_back(frame);
    }
    return out;
  };
  const int64_t before = fake_counts().kernels;
  const auto here = frames(Device{}), there = frames(fake_device());
  EXPECT_GT(fake_counts().kernels, before);
  ASSERT_EQ(here.size(), there.size());
  for (size_t f = 0; f < here.size(); ++f) {
    EXPECT_EQ(here[f].joints, there[f].joints);
    EXPECT_EQ(here[f].vertices, there[f].vertices);
  }
}

}  // namespace
}  // namespace restage
