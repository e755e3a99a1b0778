// The sweep of the learning rate: what it reads off losses that are known, and that it sweeps the
// rates that it says.
#include "train/rate_sweep.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/train/tiny_training.h"

namespace restage {
namespace {

/// A loss that falls around a rate of 1e-3, is least about 1e-2 and grows from there.
RateSweep known(int64_t steps) {
  RateSweep out;
  for (int64_t i = 0; i < steps; ++i) {
    const double decade = -6 + 6 * static_cast<double>(i) / 99;
    out.rates.push_back(std::pow(10, decade));
    out.losses.push_back(2 - std::tanh(3 * (decade + 3)) + std::exp(4 * (decade + 1)));
  }
  judge(&out);
  return out;
}

TEST(RateSweep, SuggestsWhereTheLossFallsMostSteeply) {
  const RateSweep s = known(100);
  ASSERT_EQ(s.smoothed.size(), 100u);
  EXPECT_DOUBLE_EQ(s.smoothed[0], s.losses[0]) << "the mean of one is itself";
  EXPECT_NEAR(s.smoothed[1], (0.9 * s.losses[0] + s.losses[1]) / 1.9, 1e-12);
  EXPECT_GT(s.steepest, 1e-3) << "the mean comes a little later than the loss";
  EXPECT_LT(s.steepest, 5e-3);
  EXPECT_GT(s.tenth_of_least, 1e-3);
  EXPECT_LT(s.tenth_of_least, 1e-2);
}

TEST(RateSweep, SaysNothingWhereNothingFalls) {
  EXPECT_EQ(known(12).steepest, 0) << "too few steps";
  RateSweep rising = known(100);
  for (size_t i = 0; i < rising.losses.size(); ++i) rising.losses[i] = static_cast<double>(i);
  judge(&rising);
  EXPECT_EQ(rising.steepest, 0);
  EXPECT_EQ(rising.tenth_of_least, 0);
  RateSweep restless = known(100);
  for (size_t i = 0; i < restless.losses.size(); ++i)
    restless.losses[i] = 2 + (i % 3 == 0 ? 1 : -0.5) - 0.002 * static_cast<double>(i);
  judge(&restless);
  EXPECT_EQ(restless.steepest, 0);
}

TEST(RateSweep, GoesThroughTheRatesOfEveryStage) {
  const std::vector<RateSweep> sweeps =
      find_rates(testing::tiny_training(6), testing::tiny_data(), {1e-6, 10, 30});
  ASSERT_EQ(sweeps.size(), 3u);
  EXPECT_EQ(sweeps[1].stage, "motion");
  for (const RateSweep& s : sweeps) {
    ASSERT_GT(s.rates.size(), 10u) << s.stage;
    ASSERT_LE(s.rates.size(), 30u) << s.stage;
    for (size_t i = 0; i < s.rates.size(); ++i)
      EXPECT_NEAR(std::log10(s.rates[i]), -6 + 7 * static_cast<double>(i) / 29, 1e-9) << s.stage;
    EXPECT_EQ(s.losses.size(), s.rates.size());
  }
  TrainConfig none = testing::tiny_training(6);
  for (OptimiserConfig* o : testing::optimisers(none)) o->steps = 0;
  EXPECT_TRUE(find_rates(none, testing::tiny_data()).empty());
}

}  // namespace
}  // namespace restage
