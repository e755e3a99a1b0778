// Verdicts on made-up results, and the files that ask for them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "experiments/reproduce/page.h"
#include "tests/support/files.h"

namespace restage::reproduce {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Json = nlohmann::json;

constexpr const char* kPaper = R"(paper: somebody2024
table: "4"
title: "a | b"
metrics: [mpjpe, acc]
beside: [foot_slide_mm]
tables:
  - set: naked
    rows:
      - {row: old, printed_as: theirs, printed: [0.16, 0.02]}
      - {row: new, printed: [0.15, null]}
      - {row: absent, not_run: nobody wrote it}
claims:
  - {says: new is better, where: section 4, better: new, than: old}
lite: {words: [motion.optimiser.steps=7]}
)";

class Reproduce : public FileTest {
 protected:
  void SetUp() override {
    fs::create_directories(dir / "x/trials");
    write(kPaper);
  }
  void write(const std::string& text) const { dir.write("x/paper.yaml", text); }

  /// Results of one row: for each seed an error on each of four sequences, hard ones the same for
  /// all.
  void put(const std::string& row, int seeds, double mpjpe, double acc, double scatter) {
    for (int seed = 1; seed <= seeds; ++seed) {
      Json sequences = Json::array();
      double sum = 0;
      for (int s = 0; s < 4; ++s) {
        const double value = mpjpe + 0.03 * s + scatter * ((seed * 7 + s * 3) % 5 - 2);
        sum += value / 4;
        sequences.push_back({{"name", s < 2 ? "walk-a-b" : "run-a-b"},
                             {"frames", s < 2 ? 90 : 30},
                             {"mpjpe", value},
                             {"pa_mpjpe", value / 2},
                             {"acc", acc}});
        if (s % 2 == 1) sequences.back()["name"] = s < 2 ? "walk-b-a" : "run-b-a";
      }
      const std::string id = "00000000000" + std::to_string(++made_);
      const Json result = {{"id", id.substr(id.size() - 12)},
                           {"case", row},
                           {"seed", seed},
                           {"overrides", Json::object()},
                           {"state", "done"},
                           {"error", nullptr},
                           {"artifacts", artifacts_},
                           {"training", training_},
                           {"seconds", 60},
                           {"metrics",
                            {{"naked",
                              {{"mean", {{"mpjpe", sum}, {"acc", acc}}},
                               {"sequences", sequences},
                               {"references", references_}}}}}};
      dir.write("x/trials/" + id.substr(id.size() - 12) + "/result.json", result.dump());
    }
  }
  Judgement judged() const {
    const PaperFile file = read_paper_file(dir / "x/paper.yaml");
    return judge(file, file.lite, file.claims[0], tables::read_results(dir / "x"));
  }

  /// Of the rows that are put next.
  Json references_ = Json::object(), artifacts_ = Json::object(), training_ = nullptr;

  /// A difference with this 95 % interval.
  static tables::Estimate estimate_of(double low, double high) {
    tables::Estimate out;
    out.n = kFewestSeeds;
    out.mean = (low + high) / 2;
    out.low = low;
    out.high = high;
    const double error = (high - low) / 2 / tables::student_quantile(0.95, 2);
    out.parts = {{error * error, 2}};
    return out;
  }

 private:
  int made_ = 0;
};

TEST_F(Reproduce, AKnownOrderHoldsAndItsOppositeDoesNot) {
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.09, 0.01, 0.001);
  const Judgement found = judged();
  EXPECT_EQ(found.verdict(), Verdict::holds);
  ASSERT_EQ(found.findings.size(), 2u);
  EXPECT_EQ(found.findings[0].metric, "mpjpe");
  EXPECT_NEAR(*found.findings[0].difference.mean, -0.01, 1e-12);
  EXPECT_EQ(found.findings[0].difference.n, 3);
  write(replaced(kPaper, "better: new, than: old", "better: old, than: new"));
  EXPECT_EQ(judged().verdict(), Verdict::does_not_hold);
}

TEST_F(Reproduce, ATieCannotBeTold) {
  put("old", 3, 0.10, 0.02, 0.004);
  put("new", 3, 0.10, 0.02, -0.004);
  const Judgement tie = judged();
  EXPECT_EQ(tie.verdict(), Verdict::cannot_be_told);
  EXPECT_LT(*tie.findings[0].difference.low, 0);
  EXPECT_GT(*tie.findings[0].difference.high, 0);
  for (const Finding& f : tie.findings) EXPECT_EQ(f.verdict, Verdict::cannot_be_told) << f.metric;
  write(replaced(kPaper, "than: old}", "than: old, within: 0.1}"));
  EXPECT_EQ(judged().verdict(), Verdict::holds) << "they differ by less than 10 cm";
  write(replaced(kPaper, "than: old}", "than: old, within: 0.001, metrics: [mpjpe]}"));
  EXPECT_EQ(judged().verdict(), Verdict::cannot_be_told) << "the interval is wider than that";
}

TEST_F(Reproduce, WhatDiffersIsNotAlike) {
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.06, 0.02, 0.001);
  write(replaced(kPaper, "than: old}", "than: old, within: 0.01, metrics: [mpjpe]}"));
  EXPECT_EQ(judged().verdict(), Verdict::does_not_hold);
}

TEST_F(Reproduce, WhatGotWorseIsNoImprovement) {
  const std::string unimproved =
      replaced(kPaper, "than: old}", "than: old, no_better_by: 0.01, metrics: [mpjpe]}");
  write(unimproved);
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.14, 0.02, 0.001);
  EXPECT_EQ(judged().verdict(), Verdict::holds) << "worse by 4 cm";
  write(replaced(unimproved, "better: new, than: old", "better: old, than: new"));
  EXPECT_EQ(judged().verdict(), Verdict::does_not_hold) << "better by 4 cm";
}

TEST_F(Reproduce, AGainBelowTheMarginIsNotNoticeable) {
  const auto verdict = [](double low, double high) {
    Claim claim;
    claim.no_better_by = 0.002;
    return finding_of(estimate_of(low, high), claim).verdict;
  };
  EXPECT_EQ(verdict(-0.0019, -0.001), Verdict::holds) << "better, by less than the margin";
  EXPECT_EQ(verdict(-0.001, 0.1), Verdict::holds);
  EXPECT_EQ(verdict(0.005, 0.034), Verdict::holds) << "surely worse";
  EXPECT_EQ(verdict(-0.004, -0.001), Verdict::cannot_be_told);
  EXPECT_EQ(verdict(-0.004, 0.1), Verdict::cannot_be_told);
  EXPECT_EQ(verdict(-0.004, -0.0021), Verdict::does_not_hold);
}

TEST_F(Reproduce, TwoSeedsTellNothing) {
  put("old", 2, 0.20, 0.02, 0.001);
  put("new", 2, 0.05, 0.01, 0.001);
  EXPECT_EQ(judged().verdict(), Verdict::cannot_be_told);
}

TEST_F(Reproduce, OneMetricThatIsWorseEndsAClaimButNotOneOfMost) {
  put("old", 3, 0.10, 0.01, 0.001);
  put("new", 3, 0.09, 0.02, 0.001);
  EXPECT_EQ(judged().verdict(), Verdict::does_not_hold);
  const Finding held{"", "", {}, 0, 1, Verdict::holds},
      reversed{"", "", {}, 1, 0, Verdict::does_not_hold},
      unclear{"", "", {}, 1, 1, Verdict::cannot_be_told};
  const auto verdict = [](const std::vector<Finding>& findings, bool most) {
    return judgement_of(findings, most).so_far;
  };
  EXPECT_EQ(verdict({held, held, held, held}, false), Verdict::holds);
  EXPECT_EQ(verdict({reversed, held, held, held}, true), Verdict::holds) << "three of four";
  EXPECT_EQ(verdict({reversed, held, held, held}, false), Verdict::does_not_hold);
  EXPECT_EQ(verdict({reversed, unclear, held, held}, true), Verdict::cannot_be_told);
  EXPECT_EQ(verdict({reversed, reversed, held, held}, true), Verdict::does_not_hold);
  EXPECT_EQ(verdict({reversed, reversed, Finding{}, held}, true), Verdict::not_run);
  EXPECT_EQ(verdict({}, true), Verdict::not_run);
}

TEST_F(Reproduce, OneOfManyComparisonsIsReversedByChance) {
  Finding almost{"", "", {}, 1, 0.03, Verdict::does_not_hold};
  Finding clear{"", "", {}, 0.001, 1, Verdict::holds};
  EXPECT_EQ(judgement_of({almost}, false).so_far, Verdict::does_not_hold);
  EXPECT_EQ(judgement_of({almost, clear}, false).so_far, Verdict::cannot_be_told)
      << "one of two at 3 % is nothing at 5 %";
}

TEST_F(Reproduce, ClaimsOfAPageAreJudgedTogether) {
  Judgement clear{Verdict::holds, {}, 0.001}, almost{Verdict::holds, {}, 0.04},
      never{Verdict::cannot_be_told, {}, 0.5}, absent{Verdict::not_run};
  judge_together({&almost, &never, &clear, &absent});
  EXPECT_EQ(clear.so_far, Verdict::holds);
  EXPECT_EQ(almost.so_far, Verdict::cannot_be_told) << "0.04 is more than 0.05 / 2";
  EXPECT_EQ(absent.so_far, Verdict::not_run);
  almost = {Verdict::does_not_hold, {}, 0.04};
  judge_together({&almost, &clear});
  EXPECT_EQ(almost.so_far, Verdict::does_not_hold) << "the last of two may have 0.05";
}

TEST_F(Reproduce, ASentenceWhoseReadingsDifferCannotBeTold) {
  std::vector<Claim> claims(3);
  claims[0].reading = claims[1].reading = "step by step";
  claims[2].reading = "from the first";
  const auto told = [&](const std::vector<Verdict>& verdicts) {
    const std::vector<Sentence> all = sentences_of(claims, verdicts);
    EXPECT_EQ(all.size(), 1u);
    return std::pair(sentence_verdict(all[0]), best_reading(all[0]));
  };
  using enum Verdict;
  EXPECT_EQ(told({holds, holds, holds}), std::pair(holds, holds));
  EXPECT_EQ(told({holds, does_not_hold, holds}), std::pair(cannot_be_told, holds));
  EXPECT_EQ(told({holds, does_not_hold, does_not_hold}), std::pair(does_not_hold, does_not_hold));
}

TEST_F(Reproduce, EqualPrintedFiguresSayNothing) {
  const auto printed = [&](const char* old_figures, const char* new_figures) {
    write(replaced(replaced(kPaper, "[0.16, 0.02]", old_figures), "[0.15, null]", new_figures));
    const PaperFile file = read_paper_file(dir / "x/paper.yaml");
    return printed_verdict(file, file.claims[0]);
  };
  EXPECT_EQ(printed("[0.16, 0.02]", "[0.15, null]"), Verdict::holds);
  EXPECT_EQ(printed("[0.16, 0.02]", "[0.15, 0.02]"), Verdict::holds) << "acc is the same in print";
  EXPECT_EQ(printed("[0.16, 0.02]", "[0.16, 0.02]"), Verdict::cannot_be_told);
  EXPECT_EQ(printed("[0.16, 0.02]", "[0.15, 0.021]"), Verdict::does_not_hold);
  EXPECT_EQ(printed("[0.043, 0.02]", "[0.044, 0.02]"), Verdict::does_not_hold) << "neighbours";
  EXPECT_EQ(printed("[0.16, 0.02]", "[]"), Verdict::not_run);
}

TEST_F(Reproduce, WhatStillLearnsIsNotTrainedFarEnough) {
  // The last quarter of 2,000 steps lowers the error by `gain`.
  const auto curve = [](double gain) {
    Json points = Json::array();
    for (const int step : {0, 500, 1000, 1500, 1750, 2000})
      points.push_back({step, step <= 1500 ? 0.1 + 1e-5 * (1500 - step) : 0.1 * (1 - gain)});
    return Json{{"motion",
                 {{"steps", 2000},
                  {"batch", 16},
                  {"curves", {{{"figure", "mpjpe"}, {"points", points}}}}}}};
  };
  artifacts_ = {{"motion", "0123456789ab"}};
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.09, 0.01, 0.001);
  Judgement found = judged();
  EXPECT_EQ(found.verdict(), Verdict::not_trained);
  EXPECT_EQ(found.too_short[0], "new: no curve of its motion stage was kept");
  fs::remove_all(dir / "x/trials");
  training_ = curve(0.01);
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.09, 0.01, 0.001);
  EXPECT_EQ(judged().verdict(), Verdict::holds);
  fs::remove_all(dir / "x/trials");
  put("old", 3, 0.10, 0.02, 0.001);
  training_ = curve(0.05);
  put("new", 3, 0.09, 0.01, 0.001);
  found = judged();
  EXPECT_EQ(found.verdict(), Verdict::not_trained);
  ASSERT_EQ(found.too_short.size(), 1u);
  EXPECT_EQ(found.too_short[0],
            "new: the last quarter of its steps still lowers motion.mpjpe by 5.0 %");
}

TEST_F(Reproduce, WhatWasNotRunIsNotJudged) {
  put("old", 3, 0.10, 0.01, 0.001);
  EXPECT_EQ(judged().verdict(), Verdict::not_run);
}

TEST_F(Reproduce, ThePageHasTheVerdictAndTheTablesFileBothFigures) {
  put("old", 3, 0.10, 0.02, 0.001);
  put("new", 3, 0.09, 0.01, 0.001);
  dir.write("x/sweep.yaml", "base: nothing.yaml\n");
  dir.write("x/plan.json", R"({"trials": []})");
  const std::vector<Evidence> all = find_evidence(dir.path(), "somebody2024", "", dir.path());
  ASSERT_EQ(all.size(), 1u);
  Found one{all[0], tables::Results{}};
  one.results = [&] {
    fs::remove(dir / "x/plan.json");
    return tables::read_results(dir / "x");
  }();
  one.judgements = {judge(all[0].asked, all[0].asked.lite, all[0].asked.claims[0], one.results)};
  const PageOptions options{"somebody2024", "lite", {"restage", "reproduce", "it's", "seeds=1,2"}};
  const std::string page = page_markdown({one}, options, "somebody2024", "..");
  EXPECT_TRUE(page.starts_with("# somebody2024, run again\n\nClaims: 1 holds at lite.\n\n| claim"));
  EXPECT_HAS(page, "new against old");
  EXPECT_HAS(page, "[4](somebody2024/x.md)");
  EXPECT_HAS(page, "[x](../x/README.md)");
  EXPECT_HAS(page, "6 done");
  EXPECT_HAS(page, "restage reproduce 'it'\\''s' seeds=1,2\n");
  EXPECT_EQ(page.find("theirs (paper)"), std::string::npos) << "figures have files of their own";
  const std::string table = table_markdown(one, options, "../somebody2024.md", "../..");
  EXPECT_HAS(table, "a | b");
  EXPECT_HAS(table, "theirs (paper)");
  EXPECT_HAS(table, "0.16");
  EXPECT_HAS(table, "**holds at lite**: new against old");
  EXPECT_HAS(table, "absent is not run: nobody wrote it");
  EXPECT_HAS(table, "motion.optimiser.steps=7");
  EXPECT_HAS(table, "(../somebody2024.md)");
  EXPECT_HAS(table, "[x](../../x/README.md)");
  EXPECT_EQ(page_json({one}, options)["claims"][0]["verdict"], "holds at lite");
  EXPECT_EQ(page_markdown({one}, options, "somebody2024", ".."), page) << "the same bytes again";
  EXPECT_EQ(table_markdown(one, options, "../somebody2024.md", "../.."), table);
}

TEST_F(Reproduce, TheTablesFileSaysWhereTheErrorsAre) {
  put("new", 1, 0.10, 0.02, 0);  // 100, 130, 160, 190 mm; half of that in aligned joints
  const Evidence evidence{"x", "experiments/x", dir / "x", read_paper_file(dir / "x/paper.yaml")};
  const Found one{evidence, tables::read_results(dir / "x"), {judged()}};
  const std::string text = table_markdown(one, {"somebody2024", "lite", {"restage"}}, "p", "..");
  for (const char* line :
       {"| walk, 90 frames | 57.5 |", "| run, 30 frames  | 87.5 |", "| a-b    |  65 |",
        "| b-a    |  80 |", "Worst sequences of new: run-b-a 95, run-a-b 80, walk-b-a 65, ",
        "A trial of new took 1:00."})
    EXPECT_HAS(text, line);
}

TEST_F(Reproduce, WhatLearnsNothingStandsBelowTheRowWhoseInputItSees) {
  const auto seen = [&](double noisy) {
    const auto scores = [](double mpjpe) {
      return Json{{"mean", {{"mpjpe", mpjpe}}}, {"sequences", Json::array()}};
    };
    references_ = {{"closed_form", scores(noisy)}, {"source_unchanged", scores(0.31)}};
  };
  seen(0.2);
  put("old", 2, 0.12, 0.02, 0.001);
  seen(0.4);
  put("new", 2, 0.10, 0.02, 0.001);
  const Evidence evidence{"x", "experiments/x", dir / "x", read_paper_file(dir / "x/paper.yaml")};
  const Found one{evidence, tables::read_results(dir / "x"), {judged()}};
  const std::string text = table_markdown(one, {"somebody2024", "lite", {"restage"}}, "p", "..");
  const auto value_of = [&](const std::string& label) {
    const size_t at = text.find("| " + label);
    if (at == std::string::npos || text.find("| " + label, at + 1) != std::string::npos)
      return std::string();
    const std::string line = text.substr(at, text.find('\n', at) - at);
    const size_t value = line.find_first_not_of("| ", line.find('|', 2));
    return line.substr(value, line.find(' ', value) - value);
  };
  EXPECT_EQ(value_of("old: closed form (learns nothing)"), "0.2");
  EXPECT_EQ(value_of("new: closed form (learns nothing)"), "0.4");
  EXPECT_EQ(value_of("source unchanged (learns nothing)"), "0.31");
  EXPECT_EQ(text.find("| closed form"), std::string::npos) << "an average of the two says nothing";
}

TEST_F(Reproduce, MistakesInAPaperFileAreToldWithTheirLine) {
  const auto fails = [&](const std::string& what, const std::string& by,
                         const std::string& message) {
    write(replaced(kPaper, what, by));
    EXPECT_HAS(error_of([&] { read_paper_file(dir / "x/paper.yaml"); }), message);
  };
  fails("metrics: [mpjpe, acc]", "metrics: [mpjpe, akk]", "paper.yaml:4");
  fails("title", "titel", "titel");
  fails("[0.16, 0.02]", "[0.16]", "paper.yaml:9");
  fails("row: new", "row: old", "stands here twice");
  fails("better: new", "better: now", "did you mean 'new'");
  fails("better: new", "better: old", "names one row twice");
  fails("than: old}", "than: old, within: 0.1, no_better_by: 0.1}", "two different claims");
}

TEST_F(Reproduce, CommittedResultsAreTakenAndKept) {
  write(kPaper);
  dir.write("x/sweep.yaml", "base: nothing.yaml\n");
  fs::create_directories(dir / "out");
  Evidence one = find_evidence(dir.path(), "somebody2024", "4", dir / "out")[0];
  EXPECT_FALSE(take_plan(one, "lite"));
  put("new", 1, 0.09, 0.01, 0.001);
  const std::string id = "000000000001";
  fs::create_directories(dir / "x/results");
  fs::rename(dir / ("x/trials/" + id + "/result.json"), dir / ("x/results/" + id + ".json"));
  dir.write(
      "x/results/lite.json",
      R"({"trials": [{"id": "000000000001", "case": "new", "seed": 1, "overrides": {}, "artifacts": {}},
                           {"id": "000000000002", "case": "old", "seed": 1, "overrides": {}, "artifacts": {}}]})");
  dir.write("x/results/000000000002.json", "{}");
  EXPECT_TRUE(take_plan(one, "lite"));
  EXPECT_EQ(take_results(one), 1) << "the damaged one is left out";
  EXPECT_EQ(take_results(one), 0) << "it is there now";
  EXPECT_EQ(results_of(one).count(tables::TrialState::done), 1);
  fs::remove(dir / ("x/results/" + id + ".json"));
  keep_results(one, "lite");
  EXPECT_EQ(tables::read_result(dir / ("x/results/" + id + ".json"), id).case_name, "new");
  const auto refused = [&](const std::string& paper, const std::string& table) {
    return error_of([&] { find_evidence(dir.path(), paper, table, dir / "out"); });
  };
  EXPECT_HAS(refused("somebody2023", ""), "somebody2024");
  EXPECT_HAS(refused("somebody2024", "5"), "there are 4");
}

/// A sweep of two rows of two trials, whose results stand in out/x; only `new` has other
/// references.
class Kept : public Reproduce {
 protected:
  static Json scores(double mpjpe) {
    return {
        {"mean", {{"mpjpe", mpjpe}, {"mpvd", nullptr}}},
        {"sequences", {{{"name", "walk"}, {"frames", 9}, {"mpjpe", mpjpe}, {"mpvd", nullptr}}}}};
  }
  void SetUp() override {
    Reproduce::SetUp();
    references_ = {{"rest_pose", scores(1.0 / 3)}, {"closed_form", scores(0.1)}};
    put("old", 2, 0.10, 0.02, 0.001);
    references_["closed_form"] = scores(0.2);
    put("new", 2, 0.09, 0.02, 0.001);
    dir.write("x/sweep.yaml", "base: nothing.yaml\n");
    Json trials = Json::array();
    for (int i = 1; i <= 4; ++i)
      trials.push_back({{"id", id(i)},
                        {"case", i <= 2 ? "old" : "new"},
                        {"seed", (i - 1) % 2 + 1},
                        {"overrides", Json::object()},
                        {"artifacts", Json::object()}});
    fs::create_directories(dir / "out/x");
    fs::rename(dir / "x/trials", dir / "out/x/trials");
    dir.write("out/x/plan.json", Json{{"trials", trials}}.dump());
    for (int i = 1; i <= 4; ++i) {
      Json result = Json::parse(bytes_of(result_of(i)));
      before_.push_back(result);
      result["host"] = "somebody's";
      result["command"] = "restage trial";
      write_bytes(result_of(i), result.dump());
    }
    one_ = find_evidence(dir.path(), "somebody2024", "4", dir / "out")[0];
    keep_results(one_, "lite");
    fs::remove_all(dir / "out/x");
  }
  static std::string id(int i) { return "00000000000" + std::to_string(i); }
  std::string result_of(int i) const { return dir / ("out/x/trials/" + id(i) + "/result.json"); }
  std::string kept(int i) const { return dir / ("x/results/" + id(i) + ".json"); }
  std::string reference(int i, const char* name) const {
    const Json result = Json::parse(bytes_of(kept(i)));
    return result["metrics"]["naked"]["references"][name].get<std::string>();
  }
  std::string file_of(const std::string& name) const {
    return dir / ("x/results/references/" + name + ".json");
  }
  int taken() {
    fs::remove_all(dir / "out/x");
    EXPECT_TRUE(take_plan(one_, "lite"));
    return take_results(one_);
  }

  Evidence one_;
  std::vector<Json> before_;  ///< as the trials wrote them, but for host and command
};

TEST_F(Kept, ResultsShareTheirReferencesAndLoseNothing) {
  EXPECT_EQ(std::distance(fs::directory_iterator(dir / "x/results/references"), {}), 3);
  EXPECT_EQ(reference(1, "rest_pose"), reference(4, "rest_pose"));
  EXPECT_EQ(reference(1, "closed_form"), reference(2, "closed_form"));
  EXPECT_NE(reference(2, "closed_form"), reference(3, "closed_form"));
  ASSERT_EQ(taken(), 4);
  for (int i = 1; i <= 4; ++i)
    EXPECT_EQ(Json::parse(bytes_of(result_of(i))), before_[static_cast<size_t>(i) - 1]);
  EXPECT_EQ(bytes_of(kept(1)).find("  "), std::string::npos) << "lines, not indented";
  const std::string bytes = bytes_of(kept(1));
  fs::remove(kept(1));
  keep_results(one_, "lite");
  EXPECT_EQ(bytes_of(kept(1)), bytes) << "kept again, the same bytes";
}

TEST_F(Kept, AResultWhoseReferenceIsDamagedOrNotThereIsNotTaken) {
  const std::string shared = file_of(reference(1, "rest_pose"));
  const std::string other = file_of(reference(1, "closed_form"));
  const std::string good = bytes_of(other);
  write_bytes(other, replaced(good, "0.1", "0.7"));
  EXPECT_EQ(taken(), 2) << "those that do not name it";
  write_bytes(other, good);
  EXPECT_EQ(taken(), 4);
  const std::string text = bytes_of(kept(2));
  for (const char* name : {"../x", "", "0000000000000", "00000000000g", "000000000000"}) {
    write_bytes(kept(2), replaced(text, reference(1, "rest_pose"), name));
    EXPECT_EQ(taken(), 3) << name;
  }
  write_bytes(kept(2), text);
  fs::remove(shared);
  EXPECT_EQ(taken(), 0);
}

}  // namespace
}  // namespace restage::reproduce
