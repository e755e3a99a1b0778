// Learning rates against the formulas that docs/training.md gives; constant, milestones and cosine:
// config_test.cpp.
#include "train/schedule.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/config/config.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

constexpr double kPi = 3.14159265358979323846;

ScheduleConfig schedule(const std::string& yaml) {
  ScheduleConfig config;
  read_config(parse_yaml(yaml, "x.yaml"), config);
  return config;
}

void expect_rates(const std::string& yaml, int64_t steps,
                  const std::vector<std::pair<int64_t, double>>& wanted) {
  const ScheduleConfig c = schedule(yaml);
  for (const auto& [step, rate] : wanted)
    EXPECT_NEAR(learning_rate(c, step, steps), rate, 1e-12) << yaml << ": step " << step;
}

TEST(ScheduleKinds, LinearIsALine) {
  expect_rates("{rate: 2, kind: linear, final_fraction: 0.5}", 11,
               {{0, 2}, {5, 1.5}, {10, 1}, {99, 1}});
  expect_rates("{rate: 2, kind: linear, warmup: 2}", 13, {{0, 1}, {1, 2}, {2, 2}, {7, 1}, {12, 0}});
}

TEST(ScheduleKinds, PolynomialHasAPower) {
  expect_rates("{rate: 2, kind: polynomial, power: 2}", 11, {{0, 2}, {5, 0.5}, {8, 0.08}, {10, 0}});
  expect_rates("{rate: 2, kind: polynomial, power: 0.5, final_fraction: 0.1}", 5,
               {{3, 2 * (0.1 + 0.9 * 0.5)}, {4, 0.2}});
}

TEST(ScheduleKinds, ExponentialFallsByOneFactorAStep) {
  expect_rates("{rate: 8, kind: exponential, final_fraction: 0.125}", 4,
               {{0, 8}, {1, 4}, {2, 2}, {3, 1}});
}

TEST(ScheduleKinds, RestartsBeginAnewAfterEveryPeriod) {
  const auto wave = [](double done) { return 0.1 + 0.9 * 0.5 * (1 + std::cos(kPi * done)); };
  expect_rates("{rate: 1, kind: restarts, period: 4, final_fraction: 0.1}", 100,
               {{0, 1}, {1, wave(0.25)}, {3, wave(0.75)}, {4, 1}, {7, wave(0.75)}, {96, 1}});
  // periods of 4, 8, 16 steps
  expect_rates(
      "{rate: 1, kind: restarts, period: 4, period_factor: 2, final_fraction: 0.1}", 100,
      {{4, 1}, {8, wave(0.5)}, {11, wave(7.0 / 8)}, {12, 1}, {27, wave(15.0 / 16)}, {28, 1}});
  const std::string huge = "period: 2, period_factor: 9223372036854775807";
  expect_rates("{rate: 1, kind: restarts, " + huge + "}", 1000000000, {{1, 0.5}, {999999999, 1}});
  expect_rates("{rate: 1, kind: restarts, period: 4, warmup: 2, final_fraction: 0.1}", 100,
               {{0, 0.5}, {1, 1}, {2, 1}, {5, wave(0.75)}, {6, 1}});
}

/// PyTorch 2: OneCycleLR(max_lr=1, total_steps=20, pct_start=0.25, div_factor=10,
/// final_div_factor=10), three_phase=False.
TEST(ScheduleKinds, OneCycleIsPyTorchs) {
  const auto between = [](double from, double to, double done) {
    return to + (from - to) / 2 * (1 + std::cos(kPi * done));
  };
  std::vector<std::pair<int64_t, double>> wanted;
  for (int64_t step = 0; step < 20; ++step) {
    const auto at = static_cast<double>(step);
    wanted.emplace_back(step,
                        step <= 4 ? between(0.1, 1, at / 4) : between(1, 0.01, (at - 4) / 15));
  }
  const std::string yaml =
      "{rate: 1, kind: one_cycle, rise: 0.25, initial_fraction: 0.1, final_fraction: 0.01}";
  expect_rates(yaml, 20, wanted);
  expect_rates(yaml, 20, {{0, 0.1}, {4, 1}, {19, 0.01}, {50, 0.01}});
  // short trainings and extreme shares divide by nothing
  for (const char* rise : {"0", "0.5", "1"})
    for (const int64_t steps : {1, 2, 3})
      for (int64_t step = 0; step < steps; ++step) {
        const double rate = learning_rate(
            schedule(std::string("{rate: 1, kind: one_cycle, rise: ") + rise + "}"), step, steps);
        EXPECT_TRUE(rate >= 0 && rate <= 1) << rise << " " << step << " of " << steps;
      }
}

TEST(ScheduleKinds, WhatMakesNoSenseIsRefused) {
  const auto refusal = [](const std::string& yaml) {
    return test::refusal_of([&] { schedule(yaml); });
  };
  EXPECT_HAS(refusal("kind: exponential\n"), "'final_fraction' is 0");
  EXPECT_HAS(refusal("kind: one_cycle\nwarmup: 5\n"), "x.yaml:2: 'warmup' is not for");
  EXPECT_HAS(refusal("kind: restarts\nperiod: 0\n"), "period");
  EXPECT_HAS(refusal("kind: polynomial\npower: 0\n"), "power");
}

}  // namespace
}  // namespace restage
