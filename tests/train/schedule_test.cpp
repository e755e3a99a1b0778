#include "train/schedule.h"

#include <gtest/gtest.h>

#include "nn/config/config.h"

namespace restage {
namespace {

ScheduleConfig from(const std::string& yaml) {
  ScheduleConfig config;
  read_config(parse_yaml(yaml, "x.yaml"), config);
  return config;
}

TEST(TrainSchedule, Constant) {
  const auto c = from("rate: 3e-4");
  for (const int64_t step : {0, 1, 500, 100000}) EXPECT_EQ(learning_rate(c, step, 1000), 3e-4);
}

TEST(TrainSchedule, MilestonesDropAtTheStepItself) {
  const auto c = from("{rate: 1e-4, kind: milestones, milestones: [30, 32], factor: 0.1}");
  EXPECT_EQ(learning_rate(c, 0, 34), 1e-4);
  EXPECT_EQ(learning_rate(c, 29, 34), 1e-4);
  EXPECT_EQ(learning_rate(c, 30, 34), 1e-4 * 0.1);
  EXPECT_EQ(learning_rate(c, 31, 34), 1e-4 * 0.1);
  EXPECT_EQ(learning_rate(c, 32, 34), 1e-4 * 0.1 * 0.1);
  EXPECT_EQ(learning_rate(c, 1000, 34), 1e-4 * 0.1 * 0.1);
}

TEST(TrainSchedule, CosineWithWarmup) {
  const auto c = from("{rate: 2.0, kind: cosine, warmup: 4, final_fraction: 0.25}");
  EXPECT_DOUBLE_EQ(learning_rate(c, 0, 105), 0.5);
  EXPECT_DOUBLE_EQ(learning_rate(c, 1, 105), 1.0);
  EXPECT_DOUBLE_EQ(learning_rate(c, 3, 105), 2.0);
  EXPECT_DOUBLE_EQ(learning_rate(c, 4, 105), 2.0);
  EXPECT_DOUBLE_EQ(learning_rate(c, 54, 105), 2.0 * (0.25 + 0.75 * 0.5));
  EXPECT_DOUBLE_EQ(learning_rate(c, 104, 105), 0.5);
  EXPECT_DOUBLE_EQ(learning_rate(c, 1000, 105), 0.5);
  for (int64_t step = 5; step < 105; ++step)
    EXPECT_LT(learning_rate(c, step, 105), learning_rate(c, step - 1, 105));
  EXPECT_DOUBLE_EQ(learning_rate(c, 0, 0), 0.5);  // degenerate lengths are no division by zero
  EXPECT_DOUBLE_EQ(learning_rate(from("{rate: 1, kind: cosine}"), 0, 1), 1.0);
}

TEST(TrainSchedule, BadConfigs) {
  const auto error = [](const std::string& yaml) -> std::string {
    try {
      from(yaml);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(error("kind: milestones\nmilestones: [3, 3]"),
            "x.yaml:2: 'milestones' must increase; sort the steps, each once");
  EXPECT_EQ(
      error("milestones: [3]"),
      "x.yaml:1: 'milestones' is only for 'kind: milestones'; set that kind or remove the list");
  EXPECT_EQ(error("kind: cosin"),
            "x.yaml:1: 'kind' must be one of constant, milestones, cosine, got 'cosin'; did you "
            "mean 'cosine'?");
  EXPECT_NE(error("final_fraction: 1.5"), "");
}

}  // namespace
}  // namespace restage
