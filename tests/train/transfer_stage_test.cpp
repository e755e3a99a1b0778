// The stage of the systems that move vertices: the discriminator of TST, which its program never
// trains and ours may.
#include "train/stages/transfer_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "autograd/ops/reduce.h"
#include "nn/weights/state.h"
#include "tests/support/errors.h"
#include "tests/train/tiny_training.h"

namespace restage {
namespace {

using namespace testing;

TransferStageConfig& transfer(TrainConfig& c) {
  return c.section("transfer").config.as<TransferStageConfig>();
}

/// TST on all vertices of the bodies of boxes, which correspond.
TrainConfig tiny_tst(double adversarial) {
  TrainConfig c;
  c.seed = 7;
  TransferStageConfig& s = transfer(c);
  const auto vertices = std::ssize(tiny_data().train.bodies[0].rest.vertices);
  choose(s.model, "transfer/tst",
         {"widths=[4, 5, 9]", "code=8", "hidden=6", "layers=1", "frames=3",
          "vertices=" + std::to_string(vertices)});
  s.pairs.shuffle = false;
  s.loss.adversarial = adversarial;
  s.validation_pairs = 2;
  s.optimiser.batch = 4;
  s.optimiser.steps = 8;
  s.optimiser.schedule.rate = 3e-3;
  return c;
}

/// All that the stage carries whose name has this part.
std::string bytes_of(const Stage& stage, const std::string& part) {
  TensorFile file, some;
  stage.save(file);
  for (const auto& [name, tensor] : file.tensors)
    if (name.find(part) != std::string::npos) some.tensors.emplace(name, tensor);
  EXPECT_FALSE(some.tensors.empty()) << part;
  return safetensors_bytes(some);
}

/// How real the stage's discriminator finds vertices [n, t, v, 3], mean, before the sigmoid.
double judged(const Stage& stage, const Tensor& x) {
  TensorFile file;
  stage.save(file);
  TstDiscriminator judge({.vertices = x.size(2)}, Init{});
  load_state(judge, file, "discriminator.", "stage");
  Context ctx;
  const Tensor flat = x.reshape({x.size(0) * x.size(1), x.size(2), 3});
  return mean_all(judge.logits(ctx, Var(flat))).value.item();
}

TEST(TransferStage, TheDiscriminatorLearnsToTellTheNetwork) {
  const auto stage = tiny_stage("transfer", tiny_tst(0.1));
  const double first = figure_of(stage->step(0), "discriminator");
  double last = first;
  for (int64_t i = 1; i < 8; ++i) last = figure_of(stage->step(i), "discriminator");
  EXPECT_NEAR(first, 2 * std::log(2), 0.1) << "nothing known yet";
  EXPECT_LT(last, 0.9 * first);
  NamedTensors seen = stage->examples(7);
  const auto of = [&](const std::string& name) {
    return std::find_if(seen.begin(), seen.end(), [&](const auto& x) { return x.first == name; })
        ->second;
  };
  const Bundle trained = stage->result();
  Context ctx;
  const Tensor made = trained.need_as<TransferModel>("transfer", "stage")
                          .forward(ctx, {Var(of("pose")), Var(of("identity"))})
                          .value;
  EXPECT_GT(judged(*stage, of("truth")), judged(*stage, made) + 0.1);
}

TEST(TransferStage, TheDiscriminatorOfTheProgramStaysAsItWasDrawn) {
  TrainConfig c = tiny_tst(0.1);
  transfer(c).loss.train_discriminator = false;
  const auto stage = tiny_stage("transfer", c);
  const std::string before = bytes_of(*stage, "discriminator");
  for (int64_t i = 0; i < 3; ++i) {
    for (const auto& [name, value] : stage->step(i)) EXPECT_NE(name, "discriminator");
  }
  EXPECT_TRUE(bytes_of(*stage, "discriminator") == before);
}

TEST(TransferStage, WhatTheDiscriminatorSaysCounts) {
  const auto without = tiny_stage("transfer", tiny_tst(0)),
             with = tiny_stage("transfer", tiny_tst(0.1));
  EXPECT_TRUE(bytes_of(*without, "transfer.") == bytes_of(*with, "transfer.")) << "one beginning";
  without->step(0);
  with->step(0);
  EXPECT_FALSE(bytes_of(*without, "transfer.") == bytes_of(*with, "transfer."));
  const Bundle handed_on = with->result();
  EXPECT_EQ(std::distance(handed_on.begin(), handed_on.end()), 1) << "the network alone";
}

TEST(TransferStage, GivesTheSameBitsWithAnyNumberOfThreads) {
  expect_the_same_bits("transfer", tiny_tst(0.1));
}

TEST(TransferStage, ValidationsLookAtSignals) {
  expect_validation_to_stop("transfer", tiny_tst(0));
}

TEST(TransferStage, StateGoesThroughAFile) { expect_to_resume("transfer", tiny_tst(0.1)); }

TEST(TransferStage, ADiscriminatorNeedsVerticesThatCorrespond) {
  TrainConfig c = tiny_tst(0.1);
  choose(transfer(c).model, "transfer/npt_pool", {"widths=[4, 5, 9]"});
  transfer(c).pairs.points = 48;
  EXPECT_HAS(test::refusal_of([&] { tiny_stage("transfer", c); }), "loss.adversarial");
}

}  // namespace
}  // namespace restage
