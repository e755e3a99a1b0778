// smrm/hybrid and deformation/bones: what they are before training, and that all of them learns.
#include "nn/models/hybrid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/base/rng.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/geometry/closed_form.h"
#include "nn/models/bone_field.h"
#include "nn/models/registry.h"
#include "tests/support/closed_form_joints.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_joints;

constexpr int64_t kFrames = 6;

struct Input {
  Tensor joints = Tensor::empty({2, kFrames, kJoints, 3}, DType::f64),
         trans = Tensor::full({2, kFrames, 3}, 0.5, DType::f64),
         rest = Tensor::empty({2, kJoints, 3}, DType::f64),
         turns = Tensor::empty({2, kFrames, kJoints, 3, 3}, DType::f64),
         uncertainty = Tensor::full({2, kFrames, kJoints}, 0.02, DType::f64);
  std::vector<Joints> posed[2];
  Joints rests[2] = {tiny_joints(1.1), tiny_joints(0.9, 1.2)};

  Input() {
    const Motion motion = testing::tiny_motion("m", "s", "test", kFrames);
    for (int64_t n = 0; n < 2; ++n) {
      const Body body = testing::tiny_body("a", "test", n == 0 ? 1.0 : 1.2);
      for (int j = 0; j < kJoints; ++j)
        Eigen::Map<Vec3>(rest.data<double>() + 3 * (n * kJoints + j)) = rests[n][j] - rests[n][0];
      for (int64_t t = 0; t < kFrames; ++t) {
        const PosedSkeleton x =
            forward_kinematics(body.joints, pose_on(motion, body, static_cast<size_t>(t)));
        posed[n].push_back(x.joints);
        for (int j = 0; j < kJoints; ++j) {
          const int64_t at = (n * kFrames + t) * kJoints + j;
          Eigen::Map<Vec3>(joints.data<double>() + 3 * at) = x.joints[j] - x.joints[0];
          matrix_at(turns.data<double>() + 9 * at) = x.global[j];
        }
      }
    }
  }
  MotionInput all() const { return {joints, trans, rest, turns, uncertainty}; }
  MotionInput frame(int64_t t) const {
    const auto at = [&](const Tensor& x) { return slice(Var(x), 1, t, t + 1).value; };
    return {at(joints), at(trans), rest, at(turns), at(uncertainty)};
  }
};

std::shared_ptr<MotionModel> hybrid(int64_t latency = 0, bool smoothing = false) {
  return make_model_as<MotionModel>(
      "smrm/hybrid",
      model_config("smrm/hybrid",
                   {"hidden=16", "contact=true", "latency=" + std::to_string(latency),
                    std::string("smoothing=") + (smoothing ? "true" : "false")}),
      Init{RngKey{2, 0}, DType::f64});
}

TEST(Hybrid, BeginsAsTheClosedForm) {
  const Input in;
  Context ctx;
  MotionState state;
  const MotionOutput out = hybrid()->forward(ctx, {in.joints, in.trans, in.rest, {}, {}}, &state);
  for (int64_t n = 0; n < 2; ++n) {
    const auto expected = closed_form_joints(in.posed[n], in.rests[n]);
    for (int64_t t = 0; t < kFrames; ++t)
      for (int j = 0; j < kJoints; ++j) {
        const Vec3 got = Eigen::Map<const Vec3>(out.joints.value.data<double>() +
                                                3 * ((n * kFrames + t) * kJoints + j));
        const Joints& want = expected[static_cast<size_t>(t)];
        EXPECT_LT((got - (want[j] - want[0])).norm(), 1e-2) << n << " " << t << kJointNames[j];
      }
  }
}

TEST(Hybrid, TurnsOfTheSurfaceAreWhereItBegins) {
  Input in;
  for (int64_t n = 0; n < 2; ++n) {  // A itself, whose rotations then are the answer
    const Joints own = testing::tiny_body("a", "test", n == 0 ? 1.0 : 1.2).joints;
    for (int j = 0; j < kJoints; ++j)
      Eigen::Map<Vec3>(in.rest.data<double>() + 3 * (n * kJoints + j)) = own[j] - own[0];
  }
  Context ctx;
  MotionState state, known;
  const auto net = hybrid();
  const auto off = [&](const MotionOutput& out) {  // of the first frame, before anything is kept
    double worst = 0;
    for (int64_t n = 0; n < 2; ++n) {
      Rotations global;
      for (int j = 0; j < kJoints; ++j) {
        const Mat3 local =
            matrix_at(out.rotations.value.data<double>() + 9 * (n * kFrames * kJoints + j));
        global[j] = kParents[j] < 0 ? local : Mat3(global[kParents[j]] * local);
        worst = std::max(worst, (global[j] - matrix_at(in.turns.data<double>() +
                                                       9 * (n * kFrames * kJoints + j)))
                                    .norm());
      }
    }
    return worst;
  };
  EXPECT_LT(off(net->forward(ctx, in.all(), &known)), 0.05);
  EXPECT_GT(off(net->forward(ctx, {in.joints, in.trans, in.rest, {}, {}}, &state)), 0.1);
}

TEST(Hybrid, FrameByFrameAsAtOnce) {
  const Input in;
  const auto net = hybrid();
  Context ctx;
  MotionState whole, parts;
  const MotionOutput all = net->forward(ctx, in.all(), &whole);
  for (int64_t t = 0; t < kFrames; ++t) {
    const MotionOutput one = net->forward(ctx, in.frame(t), &parts);
    const Tensor expected = slice(all.joints, 1, t, t + 1).value;
    for (int64_t i = 0; i < expected.numel(); ++i)
      EXPECT_NEAR(one.joints.value.item(i), expected.item(i), 1e-12) << t;
    for (int64_t i = 0; i < 4; ++i)
      EXPECT_NEAR(one.standing.value.item(i),
                  all.standing.value.item((i / 2 * kFrames + t) * 2 + i % 2), 1e-12)
          << t;
  }
}

/// Most that contact differs from that of `in` as it is, if from the second frame on the joints
/// drift by -`drift` m/s and the path by `path` m/s.
double contact_changed_by(double drift, double path) {
  Input in, other;
  for (int64_t n = 0; n < 2; ++n)
    for (int64_t t = 1; t < kFrames; ++t) {
      other.trans.data<double>()[3 * (n * kFrames + t)] += path;
      for (int64_t j = 0; j < kJoints; ++j)
        other.joints.data<double>()[3 * ((n * kFrames + t) * kJoints + j)] -=
            drift * static_cast<double>(t) / kFps;
    }
  const auto net = hybrid();
  Context ctx;
  MotionState one, two;
  const Tensor a = net->forward(ctx, in.all(), &one).standing.value,
               b = net->forward(ctx, other.all(), &two).standing.value;
  double most = 0;
  for (int64_t i = 0; i < a.numel(); ++i) most = std::max(most, std::abs(a.item(i) - b.item(i)));
  return most;
}

/// Contact of somebody who stands still and is looked at in directions that turn by `turn` radians
/// a frame, known (`told`) or not.
Tensor contact_of_still_feet(double turn, bool told) {
  Input in;
  Tensor reframed = Tensor::zeros({2, kFrames, 3, 3}, DType::f64);
  for (int64_t row = 0; row < 2 * kFrames; ++row) {
    const int64_t t = row % kFrames, first = row - t;
    for (int64_t j = 0; j < kJoints; ++j)
      Eigen::Map<Vec3>(in.joints.data<double>() + 3 * (row * kJoints + j)) =
          turn_about_y(turn * static_cast<double>(t)) *
          Vec3(Eigen::Map<const Vec3>(in.joints.data<double>() + 3 * (first * kJoints + j)));
    Eigen::Map<Vec3>(in.trans.data<double>() + 3 * row).setZero();
    matrix_at(reframed.data<double>() + 9 * row) = turn_about_y(t == 0 ? 0 : turn);
  }
  MotionInput seen = in.all();
  if (told) seen.reframed = reframed;
  Context ctx;
  MotionState state;
  return hybrid()->forward(ctx, seen, &state).standing.value;
}

TEST(Hybrid, ThatAPersonTurnsMovesNoFeet) {
  const Tensor still = contact_of_still_feet(0, false), told = contact_of_still_feet(0.3, true),
               untold = contact_of_still_feet(0.3, false);
  double most = 0;
  for (int64_t i = 0; i < still.numel(); ++i) {
    EXPECT_NEAR(told.item(i), still.item(i), 1e-9);
    most = std::max(most, std::abs(untold.item(i) - still.item(i)));
  }
  EXPECT_GT(most, 1e-3);
}

TEST(Hybrid, ContactSeesHowFeetMoveOverTheGroundAndNothingElse) {
  EXPECT_GT(contact_changed_by(0, 0.5), 1e-3);
  EXPECT_GT(contact_changed_by(0.5, 0), 1e-3);
  EXPECT_LT(contact_changed_by(0.5, 0.5), 1e-9) << "the same feet over the same ground";
}

TEST(Hybrid, WithLatencyItAnswersTheFrameSoManyBefore) {
  const Input in;
  Context ctx;
  MotionState at_once, later, parts;
  const MotionOutput now = hybrid()->forward(ctx, in.all(), &at_once);
  const auto net = hybrid(2);
  EXPECT_EQ(net->latency(), 2);
  const MotionOutput late = net->forward(ctx, in.all(), &later);
  const MotionOutput answered = frames_of(late, 2, kFrames), asked = frames_of(now, 0, kFrames - 2);
  ASSERT_EQ(answered.joints.shape(), asked.joints.shape());
  double apart = 0;  // untrained, both are nearly the closed form
  for (int64_t i = 0; i < asked.joints.value.numel(); ++i)
    apart = std::max(apart, std::abs(answered.joints.value.item(i) - asked.joints.value.item(i)));
  EXPECT_LT(apart, 0.02);
  for (int64_t t = 0; t < kFrames; ++t) {
    const MotionOutput one = net->forward(ctx, in.frame(t), &parts);
    const Tensor expected = slice(late.joints, 1, t, t + 1).value;
    for (int64_t i = 0; i < expected.numel(); ++i)
      EXPECT_NEAR(one.joints.value.item(i), expected.item(i), 1e-12) << t;
  }
}

/// A network whose answers are what its filters make: nothing is corrected, and all gains are
/// given.
std::shared_ptr<Hybrid> only_filters(int64_t latency, double gate, double back) {
  const auto net = std::dynamic_pointer_cast<Hybrid>(hybrid(latency, true));
  for (Linear* head : {&net->gate, &net->trend, &net->correction, &net->twist, &net->leaves,
                       &net->path, net->back ? &*net->back : nullptr}) {
    if (head == nullptr) continue;
    head->weight.value = Tensor::zeros(head->weight.value.shape(), DType::f64);
    head->bias.value = Tensor::zeros(head->bias.value.shape(), DType::f64);
  }
  const auto fill = [](Linear& head, double log_odds) {
    head.bias.value = Tensor::full(head.bias.value.shape(), log_odds, DType::f64);
  };
  fill(net->gate, std::log(gate / (1 - gate)) - 4);  // 4 and -2: where untrained gains begin
  fill(net->trend, -100);
  if (net->back) fill(*net->back, std::log(back / (1 - back)) + 2);
  return net;
}

TEST(Hybrid, FiltersKnowTheFramesThatItLooksAhead) {
  Input in;
  for (int64_t i = 0; i < in.trans.numel(); ++i)
    in.trans.data<double>()[i] = 1 + std::sin(0.9 * static_cast<double>(i * i));
  Context ctx;
  constexpr double kGate = 0.3, kBack = 0.6;
  constexpr int64_t kLate = 2;
  MotionState at_once, later, parts;
  const auto net = only_filters(kLate, kGate, kBack);
  const Tensor path = in.all().trans.value;
  const MotionOutput out = net->forward(ctx, in.all(), &later);
  const Tensor scale =
      only_filters(0, 0.999999, kBack)->forward(ctx, in.all(), &at_once).trans.value;
  for (int64_t c = 0; c < 3; ++c) {
    std::vector<double> x, y, expected, s;
    for (int64_t t = 0; t < kFrames; ++t) {
      x.push_back(path.item(3 * t + c));
      expected.push_back(t == 0 ? x[0] : y.back());
      y.push_back(kGate * x.back() + (1 - kGate) * expected.back());
    }
    for (int64_t t = 0; t + kLate < kFrames; ++t) {
      double value = y[static_cast<size_t>(t + kLate)];
      for (auto k = static_cast<size_t>(t + kLate); k-- > static_cast<size_t>(t);)
        value = y[k] + kBack * (value - expected[k + 1]);
      // The path is also scaled to B's legs, by those that the filter shows: about as unfiltered.
      const double longer = scale.item(3 * t + c) / path.item(3 * t + c);
      EXPECT_NEAR(out.trans.value.item(3 * (t + kLate) + c), value * longer, 0.02) << t;
    }
  }
  for (int64_t t = 0; t < kFrames; ++t) {  // frame by frame it is the same
    const MotionOutput one = net->forward(ctx, in.frame(t), &parts);
    const Tensor whole = slice(out.joints, 1, t, t + 1).value;
    for (int64_t i = 0; i < whole.numel(); ++i)
      EXPECT_NEAR(one.joints.value.item(i), whole.item(i), 1e-12) << t;
  }
}

TEST(Hybrid, EveryParameterGetsAGradient) {
  const Input in;
  const auto net = hybrid(2, true);
  Tape tape;
  Context ctx;
  ctx.tape = &tape;
  ctx.training = true;
  MotionState state;
  const MotionOutput out = net->forward(ctx, in.all(), &state);
  const Gradients g = tape.backward(mean_all(square(out.standing)) + mean_all(square(out.joints)) +
                                    mean_all(square(out.trans)) +
                                    mean_all(square(add_scalar(out.rotations, -0.3))));
  for (const StateEntry& entry : state_of(*net)) {
    if (entry.parameter == nullptr) continue;
    const Tensor* gradient = g.find(entry.parameter->id);
    ASSERT_NE(gradient, nullptr) << entry.name;
    double sum = 0;
    for (int64_t i = 0; i < gradient->numel(); ++i) sum += std::abs(gradient->item(i));
    EXPECT_GT(sum, 0) << entry.name;
  }
}

TEST(BoneField, DistancesAreThoseToSegments) {
  const Joints rest = tiny_joints();
  Tensor joints = Tensor::empty({1, kJoints, 3}, DType::f64),
         points = Tensor::empty({1, 3, 3}, DType::f64);
  for (int j = 0; j < kJoints; ++j) Eigen::Map<Vec3>(joints.data<double>() + 3 * j) = rest[j];
  // Beside the middle of the left forearm, before its elbow's end, and beyond its wrist.
  const Vec3 elbow = rest[18], wrist = rest[20], along = (wrist - elbow).normalized();
  const Vec3 places[] = {0.5 * (elbow + wrist) + Vec3(0, 0.1, 0), elbow - 0.2 * along,
                         wrist + 0.3 * along};
  for (int i = 0; i < 3; ++i) Eigen::Map<Vec3>(points.data<double>() + 3 * i) = places[i];
  const Tensor d = bone_distances(points, joints, bones_of(Var(joints))).value;
  const Vec3 up(0, 0.1, 0);
  EXPECT_NEAR(d.item(18), (up - along * along.dot(up)).norm(), 1e-6);
  EXPECT_NEAR(d.item(kJoints + 18), 0.2, 1e-6);
  EXPECT_NEAR(d.item(2 * kJoints + 18), 0.3, 1e-6);
}

TEST(BoneField, BeginsAtTheNearestBone) {
  const Body body = testing::tiny_body("b", "test");
  const auto net = make_model_as<DeformationModel>(
      "deformation/bones", model_config("deformation/bones", {"small_start=true"}),
      Init{RngKey{3, 0}, DType::f32});
  const auto v = static_cast<int64_t>(body.rest.vertices.size());
  Tensor points = Tensor::empty({1, v, 3}), joints = Tensor::empty({1, kJoints, 3});
  for (int64_t i = 0; i < v; ++i)
    Eigen::Map<Point>(points.data<float>() + 3 * i) = body.rest.vertices[static_cast<size_t>(i)];
  for (int j = 0; j < kJoints; ++j)
    Eigen::Map<Point>(joints.data<float>() + 3 * j) = body.joints[j].cast<float>();
  Context ctx;
  const Tensor w = net->weights(ctx, joints, points).value;
  for (int64_t i = 0; i < v; ++i) {
    float sum = 0;
    for (int j = 0; j < kJoints; ++j) sum += w.data<float>()[i * kJoints + j];
    EXPECT_NEAR(sum, 1, 1e-5);
  }
  // Vertices come in eights about each bone; the first four are at its near end.
  for (const int joint : {4, 7, 18, 19, 20}) {
    const int parent = kParents[joint];
    const int64_t middle = 8 * (joint - 1);
    double of_bone = 0;
    for (int64_t i = middle; i < middle + 8; ++i)
      of_bone += static_cast<double>(w.data<float>()[i * kJoints + parent]);
    EXPECT_GT(of_bone / 8, 0.3) << kJointNames[parent];
  }
}

}  // namespace
}  // namespace restage
