// When a trial is not worth its remaining steps.
#include "experiments/sweep/early_stop.h"

#include <gtest/gtest.h>

namespace restage::sweep {
namespace {

Curve curve(const std::vector<double>& values) {
  Curve out;
  for (const double value : values) out.push_back({10 * (std::ssize(out) + 1), value});
  return out;
}

EarlyStop rule(const std::string& name, double after = 0.3) {
  EarlyStop out;
  out.metric = "motion.pa_mpjpe";
  out.rule = name;
  out.after = after;
  return out;
}

const std::vector<Curve> kOthers = {curve({9, 7, 5, 4}), curve({9, 8, 6, 5}), curve({9, 9, 7, 6})};

TEST(EarlyStopTest, MedianComparesTheBestSoFarWithTheOthersMeans) {
  // Their means after three points are 7, 7.67 and 8.33.
  EXPECT_NE(reason_to_stop(rule("median"), curve({9, 9, 8}), 100, kOthers), "");
  EXPECT_EQ(reason_to_stop(rule("median"), curve({9, 7.6, 9}), 100, kOthers), "");
  const std::string why = reason_to_stop(rule("median"), curve({9, 9, 9}), 100, kOthers);
  EXPECT_EQ(why,
            "stopped early by median after 30 of 100 steps: motion.pa_mpjpe 9 at best, the median "
            "of 3 others is 7.667");
}

TEST(EarlyStopTest, AshaKeepsTheBestThirdAtEachRung) {
  // Rungs at 10, 30 and 90 steps. At 30 the others have 5, 6 and 7: one of four may go on.
  const EarlyStop asha = rule("asha", 0.1);
  EXPECT_EQ(reason_to_stop(asha, curve({9, 9, 4.9}), 100, kOthers), "");
  EXPECT_NE(reason_to_stop(asha, curve({9, 9, 5.5}), 100, kOthers), "");
  EXPECT_EQ(reason_to_stop(asha, curve({9, 9, 5.5, 9}), 100, kOthers), "") << "judged at 30";
  EXPECT_EQ(reason_to_stop(asha, curve({9}), 100, kOthers), "") << "nobody is better";
}

TEST(EarlyStopTest, NobodyIsJudgedTooSoonTooLateOrBesideTooFew) {
  for (const char* name : {"median", "asha"}) {
    const Curve bad = curve({20, 20, 20});
    EXPECT_NE(reason_to_stop(rule(name), bad, 100, kOthers), "") << name;
    EXPECT_EQ(reason_to_stop(rule(name, 0.31), bad, 100, kOthers), "") << name;
    EXPECT_EQ(reason_to_stop(rule(name), bad, 30, kOthers), "") << name << ": it is done";
    EXPECT_EQ(reason_to_stop(rule(name), {}, 30, kOthers), "") << name;
    EXPECT_EQ(reason_to_stop(rule(name), bad, 100, {kOthers[0], kOthers[1], curve({1, 1})}), "")
        << name << ": only two have come so far";
  }
}

TEST(EarlyStopTest, CurvesOfWhatIsStillWrittenOrDamaged) {
  const Curve found = read_curve(
      R"({"step":5,"stage":"motion","loss":0.2}
{"step":5,"stage":"motion","pa_mpjpe":0.04}
garbage "pa_mpjpe"
[1, "pa_mpjpe"]
{"step":"x","pa_mpjpe":0.03}
{"step":10,"stage":"motion","pa_mpjpe":null}
{"step":15,"stage":"motion","pa_mp)",
      "pa_mpjpe");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].done, 5);
  EXPECT_DOUBLE_EQ(found[0].value, 0.04);
  EXPECT_GT(found[1].value, 1e300) << "no number is as bad as can be";
}

}  // namespace
}  // namespace restage::sweep
