#include "experiments/evaluation/evaluation.h"

#include <gtest/gtest.h>

#include "tests/support/fake_device.h"
#include "tests/support/small_models.h"

namespace restage {
namespace {

TEST(Evaluation, OnAnotherDeviceTheFiguresAreTheSame) {
  TrainConfig config;
  config.data.bodies = config.data.motions = {1, 1, 2};
  config.evaluation.sequences = 1;
  config.evaluation.frames = 4;
  const Corpus test = load_corpus(config.data, "test");
  const EvaluationOptions how = evaluation_options(config, test, 0);
  const auto judged = [&](Device device) {
    const Bundle models = testing::untrained_bundle("smrm/hybrid", {"hidden=16", "contact=true"});
    move_networks(models, {"skeleton", "motion"}, device);
    return evaluate_system(models, "w", test, how);
  };
  const int64_t before = fake_counts().kernels;
  const SystemEvaluation here = judged(Device{}), there = judged(fake_device());
  EXPECT_GT(fake_counts().kernels, before);
  EXPECT_TRUE(here.missing.empty());
  EXPECT_EQ(here.joint_error, there.joint_error);
  ASSERT_EQ(here.conditions.size(), 3u);
  for (const auto& [condition, scores] : here.conditions) {
    ASSERT_NE(there.find(condition), nullptr) << condition;
    const auto &a = scores.model.mean, &b = there.find(condition)->model.mean;
    ASSERT_EQ(a.size(), b.size());
    for (size_t m = 0; m < a.size(); ++m) EXPECT_EQ(a[m], b[m]) << condition << ", metric " << m;
  }
}

}  // namespace
}  // namespace restage
