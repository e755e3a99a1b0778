// The lines that `restage watch` draws.
#include "experiments/sweep/live.h"

#include <gtest/gtest.h>

#include <cmath>

namespace restage::sweep {
namespace {

LiveSweep two_running() {
  LiveSweep out;
  out.metric = "motion.pa_mpjpe";
  out.counts = {{"done", 3}, {"failed", 1}, {"running", 2}, {"pending", 4}, {"stopped", 0}};
  for (const char* id : {"0123456789ab", "0123456789ac"}) {
    RunningTrial one;
    one.trial = {id, "", 1, {{"motion.optimiser.batch", 8}}, {}};
    one.stage = "motion";
    one.step = 50;
    one.steps = 200;
    one.done = 50;
    one.all = 300;
    one.seconds = 100;
    one.curve = {{10, 0.4}, {20, 0.2}, {30, 0.3}};
    one.now = 0.3;
    out.running.push_back(one);
  }
  out.best = BestTrial{out.running[0].trial, 0.125};
  out.left = 90;
  return out;
}

TEST(LiveTest, ALineForEachRunningTrial) {
  const auto lines = picture(two_running(), "runs/s", 0, 0);
  ASSERT_EQ(lines.size(), 5u);
  EXPECT_EQ(lines[0], "runs/s   3 done, 1 failed, 2 running, 4 pending   about 1:30 left");
  EXPECT_EQ(lines[1], "best   0.125 motion.pa_mpjpe  0123456789ab  batch=8, seed 1");
  EXPECT_EQ(lines[2],
            "trial        stage                             left     now      best                 "
            "          values");
  EXPECT_EQ(lines[3],
            "0123456789ab motion      ████░░░░░░░░░░░░ 25 %          0.3      0.2      █▁▄         "
            "          batch=8, seed 1");
}

TEST(LiveTest, LinesFitTheTerminal) {
  LiveSweep live = two_running();
  live.running[0].left = 4000;
  const auto lines = picture(live, "runs/s", 79, 6);
  ASSERT_EQ(lines.size(), 5u);
  EXPECT_EQ(lines[3], "0123456789ab motion      ██░░░░░░░░ 25 % 1:06:40  0.3      0.2      █▁▄");
  EXPECT_EQ(picture(two_running(), "runs/s", 79, 5).back(), "and 2 more");
  EXPECT_EQ(picture(two_running(), "runs/s", 20, 0)[3], "0123456789ab motion");
}

TEST(LiveTest, ThePaceIsThatOfTheStepsBetweenLooks) {
  Pace pace;
  LiveSweep live = two_running();
  pace.fill_in(live, 1000);
  EXPECT_NEAR(*live.running[0].left, 500, 1e-9) << "50 steps took 100 s, 250 are left";
  live.running[0].done = 100;
  live.running[1].left.reset();
  pace.fill_in(live, 1010);
  EXPECT_NEAR(*live.running[0].left, 40, 1e-9) << "50 steps took 10 s, 200 are left";
  EXPECT_NEAR(*live.running[1].left, 500, 1e-9) << "nothing new was seen";
}

TEST(LiveTest, BlocksShowTheWholeCurve) {
  EXPECT_EQ(blocks({}, 5), "");
  EXPECT_EQ(blocks({3}, 5), "▁");
  EXPECT_EQ(blocks({1, INFINITY, 0}, 5), "█x▁");
  EXPECT_EQ(blocks({0, 1, 2, 3, 4, 5, 6, 7}, 8), "▁▂▃▄▅▆▇█");
  EXPECT_EQ(blocks({8, 7, 6, 5, 4, 3, 2, 1, 0}, 3), "█▅▁");
}

}  // namespace
}  // namespace restage::sweep
