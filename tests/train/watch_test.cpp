// What a training warns of, and what it measures of its gradients' noise.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/train/tiny_training.h"
#include "train/gradient_noise.h"
#include "train/gradient_watch.h"
#include "train/profile.h"
#include "train/stage_watch.h"

namespace restage::testing {
namespace {

std::vector<std::string> kinds(const std::vector<TrainWarning>& warnings) {
  std::vector<std::string> out;
  for (const TrainWarning& one : warnings) out.push_back(one.kind);
  return out;
}
using Kinds = std::vector<std::string>;

TEST(GradientNoise, IsWhatMcCandlishSays) {
  // |G|^2 = 2 and tr(S) = 30: a batch of b examples has the squared norm 2 + 30 / b.
  GradientNoise noise(12, 3);
  for (int step = 0; step < 50; ++step) noise.add(2 + 30.0 / 4, 2 + 30.0 / 12);
  const auto values = noise.values();
  EXPECT_EQ(values[0].first, "noise_scale");
  EXPECT_NEAR(values[0].second, 15, 1e-9);
  EXPECT_NEAR(values[1].second, 30, 1e-9);
  EXPECT_NEAR(values[2].second, 2, 1e-9);

  TensorFile file;
  noise.save(&file);
  GradientNoise again(12, 3);
  EXPECT_TRUE(std::isnan(again.values()[0].second));
  again.load(file, "checkpoint");
  EXPECT_EQ(again.values(), values);
  EXPECT_THROW(again.load({}, "checkpoint"), InputError);
}

TEST(GradientNoise, OfAStageComesFromItsMicroBatches) {
  TrainConfig config = tiny_training(4);
  deformation(config).optimiser.batch = 4;
  Bundle none;
  const auto stage = make_stage(config, "deformation", tiny_data(), &none);
  EXPECT_THROW(stage->measure_noise(), InputError) << "a step is whole";
  stage->cut_steps(2, alone());
  stage->measure_noise();
  stage->step(0);
  const NamedValues values = stage->noise();
  // By the definition: E|g_2|^2 = square + trace / 2, |g_4|^2 = square + trace / 4.
  ASSERT_EQ(values.size(), 3U);
  const double trace = values[1].second, square = values[2].second;
  EXPECT_GT(square + trace / 4, 0) << "the squared norm of the step's gradient";
  EXPECT_GE(trace, 0) << "the mean of vectors is never longer than they are";
}

class Watched : public ::testing::Test {
 protected:
  Watched() : weight_(Tensor::full({8, 4}, 1.0)), bias_(Tensor::full({8}, 1.0)) {
    state_.push_back({"net.weight", &weight_.value, &weight_, "net", "test", false});
    state_.push_back({"net.bias", &bias_.value, &bias_, "net", "test", false});
  }
  /// A gradient of ones, with the first rows zero.
  Gradients gradients(int64_t zero_rows, double bias = 1) const {
    Tensor w = Tensor::full({8, 4}, 1.0);
    std::fill_n(w.data<float>(), 4 * zero_rows, 0.0f);
    Gradients out;
    out.set(weight_.id, w);
    out.set(bias_.id, Tensor::full({8}, bias));
    return out;
  }
  Parameter weight_, bias_;
  std::vector<StateEntry> state_;
};

TEST_F(Watched, DeadUnitsAreToldAfterTwoHundredSteps) {
  GradientWatch watch("skeleton", state_);
  for (int step = 0; step < 190; ++step) watch.look(nullptr, gradients(4), 1);
  EXPECT_EQ(kinds(watch.take()), Kinds{});
  for (int step = 0; step < 10; ++step) watch.look(nullptr, gradients(4), 1);
  const auto found = watch.take();
  ASSERT_EQ(kinds(found), Kinds{"dead_units"});
  EXPECT_NE(found[0].said.find("skeleton: 4 of 8 units of net.weight"), std::string::npos);
  for (int step = 0; step < 200; ++step) watch.look(nullptr, gradients(4), 1);
  EXPECT_EQ(kinds(watch.take()), Kinds{}) << "not again";

  GradientWatch few("skeleton", state_);
  for (int step = 0; step < 400; ++step) few.look(nullptr, gradients(3), 1);
  EXPECT_EQ(kinds(few.take()), Kinds{}) << "some dead units are usual";
  GradientWatch now_and_then("skeleton", state_);
  for (int step = 0; step < 400; ++step)
    now_and_then.look(nullptr, gradients(step % 190 == 0 ? 0 : 8), 1);
  EXPECT_EQ(kinds(now_and_then.take()), Kinds{});
}

TEST_F(Watched, ParametersWithoutGradientAreTold) {
  GradientWatch watch("skeleton", state_);
  for (int step = 0; step < 200; ++step) watch.look(nullptr, gradients(0, 0), 1);
  const auto found = watch.take();
  ASSERT_EQ(kinds(found), Kinds{"dead_parameters"});
  EXPECT_NE(found[0].said.find("net.bias"), std::string::npos);
}

TEST_F(Watched, ANormThatGrowsByOrdersIsTold) {
  GradientWatch watch("skeleton", state_);
  const auto steps = [&](int n, double norm) {
    for (int step = 0; step < n; ++step) watch.look(nullptr, gradients(0), norm);
    return kinds(watch.take());
  };
  EXPECT_EQ(steps(40, 0.5), Kinds{});
  EXPECT_EQ(steps(1, 5e5), Kinds{}) << "one step may be an outlier";
  EXPECT_EQ(steps(10, 0.5), Kinds{});
  EXPECT_EQ(steps(20, 100), Kinds{}) << "two orders are not enough";
  EXPECT_EQ(steps(3, 1e6), Kinds{"exploding_gradient"});
}

TEST(StageWatch, WhatNeverChangesIsToldOnce) {
  TrainConfig config = tiny_training(4);
  Bundle none;
  const auto stage = make_stage(config, "deformation", tiny_data(), &none);
  StageWatch watch(*stage);
  Kinds found;
  for (int step = 0; step < 320; ++step) {
    const double loss = step < 50 ? step : 7;
    for (const std::string& kind : kinds(watch.after_step({{"loss", loss}}, {})))
      found.push_back(kind + " " + std::to_string(step));
  }
  EXPECT_EQ(found, Kinds{"constant_loss 150"});
  EXPECT_EQ(kinds(watch.after_validation({{"a", 1}}, 10)), Kinds{});
  EXPECT_EQ(kinds(watch.after_validation({{"a", 1}}, 20)), Kinds{});
  EXPECT_EQ(kinds(watch.after_validation({{"a", 1}}, 20)), Kinds{}) << "no step in between";
  EXPECT_EQ(kinds(watch.after_validation({{"a", 1}}, 30)), Kinds{"constant_figures"});
}

TEST(StageWatch, SlowExamplesAreTold) {
  TrainConfig config = tiny_training(4);
  Bundle none;
  const auto stage = make_stage(config, "deformation", tiny_data(), &none);
  const auto steps = [&](double draw) {
    StageWatch watch(*stage);
    Kinds found;
    PhaseTimes times;
    times.seconds[static_cast<size_t>(Phase::draw)] = draw;
    times.seconds[static_cast<size_t>(Phase::forward)] = 0.4;
    times.seconds[static_cast<size_t>(Phase::backward)] = 0.6;
    for (int step = 0; step < 100; ++step)
      for (const auto& kind : kinds(watch.after_step({{"loss", step}}, times)))
        found.push_back(kind);
    return found;
  };
  EXPECT_EQ(steps(0.9), Kinds{});
  EXPECT_EQ(steps(1.1), Kinds{"slow_examples"});
}

TEST(StageWatch, PhasesOfAStepAreTimed) {
  TrainConfig config = tiny_training(4);
  Bundle none;
  const auto stage = make_stage(config, "skeleton", tiny_data(), &none);
  take_phase_times();
  stage->step(0);
  const PhaseTimes times = take_phase_times();
  for (const Phase phase : {Phase::draw, Phase::forward, Phase::backward, Phase::optimise})
    EXPECT_GT(times.of(phase), 0) << name_of(phase);
  EXPECT_EQ(take_phase_times().work(), 0);
}

TEST(TrainProfile, CountsOpsOfBothPasses) {
  TrainConfig config = tiny_training(4);
  Bundle none;
  const auto stage = make_stage(config, "deformation", tiny_data(), &none);
  TrainProfile profile;
  profile.on_begin(*stage, 0);
  const NamedValues watched = stage->step(0);
  profile.on_step(*stage, 1, watched);
  profile.finish();
  const std::string trace = profile.trace();
  for (const char* part : {"\"name\":\"linear\"", "\"pass\":\"backward\"", "\"ph\":\"C\"",
                           "deformation", "\"bytes_at_backward\":"})
    EXPECT_NE(trace.find(part), std::string::npos) << part;
  stage->step(1);
  EXPECT_EQ(profile.trace(), trace) << "nobody watches any more";
}

}  // namespace
}  // namespace restage::testing
