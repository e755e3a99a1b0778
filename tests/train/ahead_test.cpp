// Drawing ahead changes when examples are made, and not which.
#include "train/ahead.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace restage {
namespace {

/// Steps that were drawn, from any thread.
struct Log {
  std::mutex mutex;
  std::vector<int64_t> steps;
  int64_t draw(int64_t step) {
    const std::lock_guard lock(mutex);
    steps.push_back(step);
    return 10 * step;
  }
};

TEST(TrainAhead, GivesWhatIsAskedForInAnyOrder) {
  Log log;
  const auto draw = [&](int64_t step, const MicroBatch& part) {
    return log.draw(step) + part.index;
  };
  {
    Ahead<int64_t> ahead;
    for (const int64_t step : {0, 1, 2, 7, 7, 8})
      EXPECT_EQ(ahead.take(true, step, {}, draw), 10 * step);
    EXPECT_EQ(ahead.take(true, 9, {1, 2}, draw), 91) << "of several micro-batches: drawn at once";
    EXPECT_EQ(ahead.take(false, 5, {}, draw), 50);
  }
  std::sort(log.steps.begin(), log.steps.end());
  EXPECT_EQ(log.steps, (std::vector<int64_t>{0, 1, 2, 3, 5, 7, 7, 8, 8, 9, 9}));
}

TEST(TrainAhead, AnErrorComesWithTheStepThatItBelongsTo) {
  const auto draw = [](int64_t step, const MicroBatch&) {
    if (step == 1) throw std::runtime_error("no step 1");
    return step;
  };
  Ahead<int64_t> ahead;
  EXPECT_EQ(ahead.take(true, 0, {}, draw), 0);
  EXPECT_THROW(ahead.take(true, 1, {}, draw), std::runtime_error);
  EXPECT_EQ(ahead.take(true, 2, {}, draw), 2);
}

}  // namespace
}  // namespace restage
