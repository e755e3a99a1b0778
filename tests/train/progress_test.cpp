#include "train/progress.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/files.h"

namespace restage {
namespace {

/// A terminal, or a file, with a clock that the test turns.
struct Screen {
  std::string text;
  int writes = 0;
  double time = 100;
  int columns = 80;
  ProgressOutput output(bool terminal) {
    ProgressOutput out;
    out.write = [this](std::string_view piece) {
      text += piece;
      ++writes;
    };
    out.clock = [this] { return time; };
    out.width = [this] { return columns; };
    out.terminal = terminal;
    return out;
  }
};

TEST(TrainProgress, Durations) {
  EXPECT_EQ(duration_text(0), "0:00");
  EXPECT_EQ(duration_text(59.6), "1:00");
  EXPECT_EQ(duration_text(754), "12:34");
  EXPECT_EQ(duration_text(3600 * 3 + 4 * 60 + 5), "3:04:05");
  EXPECT_EQ(duration_text(-1), "0:00");
}

TEST(TrainProgress, PlainLinesEveryTenSeconds) {
  Screen screen;
  Progress progress("smrm", 200, screen.output(false));
  for (int step = 1; step <= 200; ++step) {
    screen.time += 0.25;
    progress.update(step, {{"loss", 1.0 / step}, {"cycle", 0.002}});
  }
  progress.finish();
  EXPECT_EQ(screen.text,
            "smrm   0% 1/200  4.0/s  ETA 0:50  loss 1  cycle 0.002\n"
            "smrm  20% 41/200  4.0/s  ETA 0:40  loss 0.02439  cycle 0.002\n"
            "smrm  40% 81/200  4.0/s  ETA 0:30  loss 0.01235  cycle 0.002\n"
            "smrm  60% 121/200  4.0/s  ETA 0:20  loss 0.008264  cycle 0.002\n"
            "smrm  80% 161/200  4.0/s  ETA 0:10  loss 0.006211  cycle 0.002\n"
            "smrm 100% 200/200  took 0:50  loss 0.005  cycle 0.002\n");
}

TEST(TrainProgress, QuietSaysNothing) {
  Screen screen;
  for (const bool terminal : {false, true}) {
    ProgressOutput out = screen.output(terminal);
    out.quiet = true;
    Progress progress("smrm", 10, out);
    progress.update(1);
    progress.note("x");
    progress.finish();
  }
  EXPECT_EQ(screen.text, "");
}

TEST(TrainProgress, BarRedrawsInPlaceAtMostTenTimesASecond) {
  Screen screen;
  {
    Progress progress("skeleton", 100, screen.output(true));
    for (int step = 1; step <= 50; ++step) {
      screen.time += 0.01;
      progress.update(step, {{"loss", 0.5}});
    }
    EXPECT_LE(screen.writes, 6);
    EXPECT_EQ(screen.text.find('\n'), std::string::npos);
    EXPECT_EQ(screen.text.rfind("\rskeleton [-----", 0), 0u) << screen.text;
    EXPECT_EQ(screen.text.find("\x1b[32m"), std::string::npos);
    screen.text.clear();
    progress.note("validation 0.04");
    EXPECT_EQ(screen.text.rfind("\r\x1b[Kvalidation 0.04\n\rskeleton [", 0), 0u) << screen.text;
    screen.text.clear();
    progress.clear();
    progress.clear();
    EXPECT_EQ(screen.text, "\r\x1b[K") << "room for somebody else's line";
    screen.text.clear();
    screen.time += 1;
    progress.finish();
    EXPECT_EQ(screen.text.back(), '\n');
    progress.finish();
    progress.update(99);
  }
  EXPECT_HAS(screen.text, " 50% 50/100  took 0:02");
}

TEST(TrainProgress, BarFitsAnyWidth) {
  for (int columns : {0, 1, 2, 10, 20, 30, 40, 60, 79, 80, 200}) {
    Screen screen;
    screen.columns = columns;
    Progress progress("deformation", 1000, screen.output(true));
    screen.time += 5;
    progress.update(500, {{"loss", 0.123456}, {"skinning", 1e-9}, {"offsets", 12345678.0}});
    ASSERT_EQ(screen.text.front(), '\r');
    ASSERT_TRUE(screen.text.ends_with("\x1b[K"));
    const std::string line = screen.text.substr(1, screen.text.size() - 4);
    EXPECT_LE(static_cast<int>(line.size()), std::max(columns - 1, 1)) << line;
    if (columns >= 60) {
      EXPECT_HAS(line, "###");
      EXPECT_HAS(line, "100.0/s  ETA 0:05");
    }
    if (columns == 200) {
      EXPECT_EQ(line,
                "deformation [###############---------------]  50% 500/1000  100.0/s  ETA 0:05  "
                "loss 0.1235  "
                "skinning 1e-09  offsets 1.235e+07");
    }
  }
}

TEST(TrainProgress, ColourOnlyWhenWanted) {
  Screen screen;
  ProgressOutput out = screen.output(true);
  out.colour = true;
  Progress progress("x", 10, out);
  screen.time += 1;
  progress.update(5);
  EXPECT_HAS(screen.text, "[\x1b[32m###");
  EXPECT_HAS(screen.text, "#\x1b[0m-");
  ::setenv("NO_COLOR", "1", 1);
  EXPECT_FALSE(standard_progress().colour);
  ::unsetenv("NO_COLOR");
  EXPECT_TRUE(standard_progress(true).quiet);
  EXPECT_GT(standard_progress().width(), 0);
}

TEST(TrainProgress, ResumedRateCountsOnlyNewSteps) {
  Screen screen;
  Progress progress("x", 1000, screen.output(false), 900);
  screen.time += 10;
  progress.update(905);
  EXPECT_EQ(screen.text, "x  90% 905/1000  2.0 s/step  ETA 3:10\n");
}

TEST(TrainProgress, NothingToDo) {
  Screen screen;
  Progress progress("x", 0, screen.output(false));
  progress.update(0);
  progress.finish();
  EXPECT_EQ(screen.text, "x 100% 0/0\nx 100% 0/0  took 0:00\n");
}

}  // namespace
}  // namespace restage
