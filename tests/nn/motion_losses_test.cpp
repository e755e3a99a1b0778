// The losses of motion: whose gradients they give, and NKN's twist.
#include "nn/losses/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/evaluate.h"
#include "nn/models/smrm.h"

namespace restage {
namespace {

using gradcheck::random;
using gradcheck::same_bits;

constexpr double kPi = 3.14159265358979323846;

struct Players {
  Players() {
    batch.joints = batch.input = random({3, 9, kJoints, 3}, 1);
    batch.trans = batch.true_trans = random({3, 9, 3}, 2);
    batch.rest_a = random({3, kJoints, 3}, 3);
    batch.rest_b = random({3, kJoints, 3}, 4);
    batch.sixd = random({3, 9, kJoints, 6}, 5);
    batch.self_mask = Tensor::from<double>({3}, {0, 1, 0});
  }
  Gradients gradients(bool of_judge) {
    Tape tape;
    Context ctx{&tape, true, RngKey{8, 0}};
    return tape.backward(motion_losses(ctx, net, &judge, batch, {}, of_judge).total);
  }
  Smrm net{{.hidden = 4}, Init{RngKey{1, 0}, DType::f64}};
  Discriminator judge{{.widths = {2, 2, 2, 2}}, Init{RngKey{2, 0}, DType::f64}};
  MotionBatch batch;
};

TEST(MotionLosses, TheGeneratorsStepHasNoGradientOfTheDiscriminator) {
  Players a, b;
  const Gradients g = a.gradients(false), with = b.gradients(true);
  for (const Parameter* p : parameters_of(a.judge)) EXPECT_EQ(g.find(p->id), nullptr);
  for (const Parameter* p : parameters_of(b.judge)) EXPECT_NE(with.find(p->id), nullptr);
  std::vector<uint64_t> own;
  const auto ours = parameters_of(a.net), theirs = parameters_of(b.net);
  for (size_t i = 0; i < ours.size(); ++i) {  // the generator's own are what they were
    own.push_back(ours[i]->id);
    ASSERT_TRUE(g.find(ours[i]->id) && with.find(theirs[i]->id));
    EXPECT_TRUE(same_bits(*g.find(ours[i]->id), *with.find(theirs[i]->id))) << i;
  }
  EXPECT_DOUBLE_EQ(g.norm(), g.norm(own));
  EXPECT_GT(with.norm(), g.norm() * (1 + 1e-9)) << "the discriminator must have weight here";
}

TEST(MotionLosses, AConstantDiscriminatorStillKeepsItsRunningStatistics) {
  Players a, b;
  const Tensor start = a.judge.bns[0].running_mean;
  a.gradients(false);
  b.gradients(true);
  const auto x = state_of(a.judge), y = state_of(b.judge);
  for (size_t i = 0; i < x.size(); ++i) EXPECT_TRUE(same_bits(*x[i].value, *y[i].value)) << i;
  EXPECT_FALSE(same_bits(a.judge.bns[0].running_mean, start));
}

/// Answers joints, and how sure it is that feet stand, as they were given to it.
struct Given final : MotionModel {
  MotionOutput forward(Context&, const MotionInput& in, MotionState*) const override {
    MotionOutput out;
    out.joints = joints;
    out.trans = in.trans;
    out.rotations = Var(Tensor::zeros({3, 9, kJoints, 3, 3}, DType::f64));
    out.standing = standing;
    return out;
  }
  void standardise(const MotionStatistics&) override {}
  void visit(Fields&) override {}
  const char* kind() const override { return "Given"; }
  Tensor joints, standing;
};

TEST(MotionLosses, AccelerationIsOfSecondDifferences) {
  Players p;
  Given net;
  net.joints = p.batch.joints.value.clone();
  net.standing = Tensor::zeros({3, 9, 2}, DType::f64);
  for (int64_t i = 0; i < 3 * 9; ++i)  // a steady drift, and one frame that is 1 m off in x
    for (int64_t j = 0; j < kJoints; ++j)
      net.joints.data<double>()[3 * (i * kJoints + j)] +=
          0.1 * static_cast<double>(i % 9) + (i % 9 == 4 ? 1 : 0);
  const auto losses = [&](MotionWeights w) {
    Context ctx;
    return self_losses(ctx, net, p.batch, w);
  };
  MotionWeights w{.cycle = 1, .rotation = 0, .smoothness = 0};
  w.measure = Measure::distance;
  const double plain = losses(w).total.value.item();
  w.acceleration = 0.5;
  const MotionLosses with = losses(w);
  EXPECT_NEAR(with.acceleration.value.item(), (1.0 + 2.0 + 1.0) / 7, 1e-3) << "a drift has none";
  EXPECT_NEAR(with.total.value.item() - plain, 0.5 * 4.0 / 7, 1e-3);
}

TEST(MotionLosses, TheFirstVersionSmoothsThePath) {
  Players p;
  Given net;
  net.joints = p.batch.joints.value;
  net.standing = Tensor::zeros({3, 9, 2}, DType::f64);
  p.batch.trans = Var(Tensor::zeros({3, 9, 3}, DType::f64));
  for (int64_t i = 0; i < 3 * 9; ++i)  // velocities: steadily faster in x, one kick in z
    p.batch.trans.value.data<double>()[3 * i] = 0.5 * static_cast<double>(i % 9),
                                           p.batch.trans.value.data<double>()[3 * i + 2] =
                                               i % 9 == 4;
  MotionWeights w;
  Context ctx;
  const auto both = [&] {  // A -> A, and A -> B -> A, of which this net hands on the path
    return std::pair{self_losses(ctx, net, p.batch, w).total.value.item(),
                     motion_losses(ctx, net, nullptr, p.batch, w).total.value.item()};
  };
  const auto plain = both();
  w.path_smoothness = 0.1;
  const double expected = 0.1 * (8 * 0.25 + 2 * 1.0) / (8 * 3);
  EXPECT_NEAR(both().first - plain.first, expected, 1e-9);
  EXPECT_NEAR(both().second - plain.second, expected, 1e-9);
}

TEST(MotionLosses, FeetThatStandAreACrossEntropy) {
  Players p;
  Given net;
  net.joints = p.batch.joints.value;
  net.standing = Tensor::full({3, 9, 2}, 2, DType::f64);
  MotionWeights w;
  Context ctx;
  const double nobody_knows = self_losses(ctx, net, p.batch, w).total.value.item();
  w.contact = 0.1;
  EXPECT_EQ(self_losses(ctx, net, p.batch, w).total.value.item(), nobody_knows);
  for (const double truth : {0.0, 1.0}) {
    p.batch.standing = Tensor::full({3, 9, 2}, truth, DType::f64);
    EXPECT_NEAR(self_losses(ctx, net, p.batch, w).total.value.item() - nobody_knows,
                0.1 * std::log(1 + std::exp(truth > 0 ? -2.0 : 2.0)), 1e-9);
  }
}

/// Rotations [1, 1, j, 3, 3] whose R00 and R20 belong to angles about y, degrees.
Tensor about_y(const std::vector<double>& angles, double radius = 1) {
  const auto j = static_cast<int64_t>(angles.size());
  Tensor r = random({1, 1, j, 3, 3}, 1);
  for (size_t i = 0; i < angles.size(); ++i) {
    r.data<double>()[9 * i] = radius * std::cos(angles[i] * kPi / 180);
    r.data<double>()[9 * i + 6] = -radius * std::sin(angles[i] * kPi / 180);
  }
  return r;
}

TEST(TwistLoss, IsTheSquaredExcessOverAHundredDegrees) {
  const auto loss = [](const Tensor& r) { return twist_loss(Var(r)).value.item(); };
  const double unit = std::pow(10 * kPi / 180, 2);  // ten degrees too many
  EXPECT_DOUBLE_EQ(loss(about_y({170, 99, -99, 0})), 0) << "the root may turn";
  EXPECT_NEAR(loss(about_y({0, 110, -120, 60})), unit * (1 + 4) / 3, 1e-12);
  EXPECT_NEAR(loss(about_y({0, 110, -120, 60}).cast(DType::f32)), unit * (1 + 4) / 3, 1e-6);
}

TEST(TwistLoss, PassesTheGradientHarness) {
  gradcheck::OpSamples s{"twist_loss", ""};
  s.add("some beyond the limit", {about_y({150, 110, -130, 60, -20, 170})},
        [](gradcheck::Args x) { return twist_loss(x[0]); });
  s.add("off the unit circle", {about_y({10, 110, -130, 60}, 0.3)},
        [](gradcheck::Args x) { return twist_loss(x[0]); });
  for (const gradcheck::Sample& sample : s.samples) {
    const gradcheck::Report r = check_sample(s, sample);
    EXPECT_TRUE(r.ok()) << r.text();
  }
}

TEST(TwistLoss, HasNoGradientWhereTheAngleMeansNothing) {
  Tape tape;
  const Var r = tape.leaf(about_y({0, 180, 120}, 1e-9), 1);  // gimbal lock
  const Gradients g = tape.backward(twist_loss(r));
  for (const double v : g.find(1)->to_vector<double>()) EXPECT_EQ(v, 0);
}

}  // namespace
}  // namespace restage
