// Results of trials, however damaged, and the rows that are made of them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "autograd/base/atomic_file.h"
#include "experiments/sweep/sweep_dir.h"
#include "experiments/sweep/table_formats.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"

namespace restage::tables {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Json = nlohmann::json;

class TableTest : public FileTest {
 protected:
  void SetUp() override { fs::create_directories(dir / "trials"); }

  static std::string id(int i) {
    const std::string digits = std::to_string(i);
    return std::string(12 - digits.size(), 'a') + digits;
  }
  static Json trial(int i, const std::string& name, int seed, const Json& overrides, double value) {
    const Json one = {{"name", "walk"}, {"frames", 60}, {"mpjpe", value - 0.01}, {"mpvd", nullptr}};
    const Json two = {{"name", "jump"}, {"frames", 60}, {"mpjpe", value + 0.01}, {"mpvd", nullptr}};
    return {{"id", id(i)},
            {"case", name},
            {"seed", seed},
            {"overrides", overrides},
            {"state", "done"},
            {"error", nullptr},
            {"artifacts", {{"motion", "0123456789ab"}}},
            {"seconds", 1.5},
            {"metrics",
             {{"naked",
               {{"mean", {{"mpjpe", value}, {"mpvd", nullptr}}}, {"sequences", {one, two}}}}}}};
  }
  void put(const Json& result) const {
    dir.write("trials/" + result["id"].get<std::string>() + "/result.json", result.dump());
  }
  /// Cases quaternion and 6D, each with a = 0 and 1 and seeds 1, 2, 3.
  void put_sweep() const {
    int i = 0;
    for (const char* name : {"quaternion", "6D"})
      for (int a = 0; a < 2; ++a)
        for (int seed = 1; seed <= 3; ++seed)
          put(trial(++i, name, seed, {{"a", a}, {"model", std::string("m/") + name}},
                    0.1 + 0.02 * a + 0.001 * seed * seed + (name[0] == '6' ? 0.05 : 0)));
  }
};

TEST_F(TableTest, RowsAreCasesAndOverridesAndSeedsAreRepetitions) {
  put_sweep();
  const Results results = read_results(dir.path());
  EXPECT_TRUE(results.notices.empty());
  const Table table = make_table(results, {});
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_EQ(table.rows[0].label, "6D, a=0");  // the case says which model it is
  EXPECT_EQ(table.rows[3].label, "quaternion, a=1");
  EXPECT_EQ(table.rows[3].overrides.at("model"), "m/quaternion");
  EXPECT_EQ(table.rows[3].seeds, (std::vector<uint64_t>{1, 2, 3}));
  const Estimate& e = table.rows[3].cells[0][0].value;
  EXPECT_EQ(e.n, 3);
  EXPECT_NEAR(*e.mean, 0.12 + 0.014 / 3, 1e-12);
  EXPECT_NEAR(*e.deviation, 0.004041451884327381, 1e-12);  // np.std([.001, .004, .009], ddof=1)
  const Json json = to_json(table, results);
  EXPECT_TRUE(json["rows"][0]["metrics"]["naked"]["mpvd"]["mean"].is_null());
  EXPECT_EQ(json["rows"][0]["metrics"]["naked"]["mpvd"]["n"], 0);
  EXPECT_EQ(json["trials"]["done"], 12);
}

TEST_F(TableTest, DifferencesArePairedBySeed) {
  put_sweep();
  const Table table =
      make_table(read_results(dir.path()), {.columns = {"mpjpe"}, .against = "quaternion, a=0"});
  const Estimate d = *table.rows[0].cells[0][0].difference;
  EXPECT_EQ(d.n, 3);
  EXPECT_NEAR(*d.mean, 0.05, 1e-12);
  EXPECT_NEAR(*d.low, 0.05, 1e-12);  // the same for every seed and sequence
  EXPECT_FALSE(table.rows[*table.against].cells[0][0].difference);
}

TEST_F(TableTest, RowsByAKeyPoolTheOthersAndSaySo) {
  put_sweep();
  const Table table = make_table(read_results(dir.path()), {.rows = {"a"}, .against = "a=0"});
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0].n, 6);
  EXPECT_EQ(table.rows[0].seeds.size(), 3u);
  EXPECT_NEAR(*table.rows[1].cells[0][0].difference->mean, 0.02, 1e-12);
  EXPECT_EQ(table.rows[1].cells[0][0].difference->n, 6);  // paired by case and seed
  ASSERT_EQ(table.notices.size(), 1u);
  EXPECT_HAS(table.notices[0], "'case'");
}

TEST_F(TableTest, UnknownNamesAreToldWithWhatThereIs) {
  put_sweep();
  const Results results = read_results(dir.path());
  const auto error = [&](const TableOptions& options) {
    return error_of([&] { make_table(results, options); });
  };
  EXPECT_HAS(error({.rows = {"mode"}}), "did you mean 'model'?");
  EXPECT_HAS(error({.columns = {"mpjep"}}), "did you mean 'mpjpe'?");
  EXPECT_HAS(error({.against = "8D"}), "the rows are '6D, a=0', '6D, a=1'");
  EXPECT_HAS(error({.against = "6D"}), "beginning of 2 rows");
  EXPECT_EQ(make_table(results, {.against = "quaternion, a=1"}).against, 3u);
}

TEST_F(TableTest, WhatIsNotDoneIsCountedAndNotAveraged) {
  put_sweep();
  Json failed = trial(1, "quaternion", 1, {{"a", 0}, {"model", "m/quaternion"}}, 5);
  failed["state"] = "failed";
  failed["error"] = "restage: the loss is not finite";
  put(failed);
  fs::create_directories(dir / "trials/" + id(77));
  const Results results = read_results(dir.path());
  EXPECT_EQ(counts_text(results), "11 done, 1 failed, 1 pending");
  const Table table = make_table(results, {});
  EXPECT_EQ(table.rows[2].n, 2);
  EXPECT_LT(*table.rows[2].cells[0][0].value.mean, 1);
}

TEST_F(TableTest, DamagedAndForeignResultsAreToldAndNotUsed) {
  put_sweep();
  const std::string good =
      trial(1, "quaternion", 1, {{"a", 0}, {"model", "m/quaternion"}}, 0.1).dump();
  const auto with = [&](const char* place, const Json& value) {
    Json json = Json::parse(good);
    json[Json::json_pointer(place)] = value;
    return json.dump();
  };
  Json deep;
  for (int i = 0; i < 50; ++i) deep = Json::array({deep});
  const std::vector<std::string> bad = {"",
                                        "{",
                                        "[]",
                                        "null",
                                        good.substr(0, good.size() / 2),
                                        good + good,
                                        "\xff\xfe",
                                        with("/id", id(2)),
                                        with("/id", 5),
                                        with("/seed", -1),
                                        with("/seed", "1"),
                                        with("/case", 3),
                                        with("/state", "running"),
                                        with("/state", "damaged"),
                                        with("/overrides", 1),
                                        with("/overrides/a", deep),
                                        with("/metrics", nullptr),
                                        with("/metrics/naked", 1),
                                        with("/metrics/naked/mean", Json::array()),
                                        with("/metrics/naked/mean/mpjpe", "0.1"),
                                        with("/metrics/naked/sequences", nullptr),
                                        with("/metrics/naked/sequences/0", 1),
                                        with("/metrics/naked/sequences/0/name", nullptr),
                                        with("/metrics/naked/sequences/0/name", "jump"),
                                        with("/artifacts", "x"),
                                        with("/seconds", "long"),
                                        "{\"id\": 1e999}"};
  for (const std::string& text : bad) {
    dir.write("trials/" + id(1) + "/result.json", text);
    const Results results = read_results(dir.path());
    EXPECT_EQ(results.notices.size(), 1u) << text;
    EXPECT_EQ(counts_text(results), "11 done, 1 damaged") << text;
    EXPECT_EQ(make_table(results, {}).rows[2].n, 2) << text;
  }
  dir.write("trials/" + id(1) + "/result.json", good);
  EXPECT_EQ(counts_text(read_results(dir.path())), "12 done");
}

TEST_F(TableTest, AResultThatCannotBeReadIsNotDamaged) {
  put_sweep();
  const std::string path = dir / "trials/" + id(1) + "/result.json";
  {
    const Unreadable loop(path);
    expect_error<ReadError>([&] { read_results(dir.path()); }, {path, "symbolic links"});
    // The trial may be done: it must not be run again.
    sweep::SweepDir sweep;
    sweep.path = dir.path();
    EXPECT_THROW(sweep::read_result(sweep, id(1)), ReadError);
  }
  EXPECT_EQ(counts_text(read_results(dir.path())), "12 done");
}

TEST_F(TableTest, ThePlanSaysWhatBelongs) {
  put_sweep();
  Json plan = {{"trials", Json::array()}};
  for (const int seed : {1, 2, 3, 4}) {
    Json entry = trial(seed < 4 ? 6 + seed : 99, "6D", seed, {{"a", 0}, {"model", "m/6D"}}, 0);
    plan["trials"].push_back(entry);
  }
  dir.write("plan.json", plan.dump());
  const Results results = read_results(dir.path());
  EXPECT_EQ(counts_text(results), "3 done, 1 pending");
  EXPECT_EQ(results.notices.size(), 9u);  // of an earlier plan
  EXPECT_EQ(make_table(results, {}).rows.size(), 1u);
  // A result that answers another question than the plan asks under this id.
  plan["trials"][0]["seed"] = 5;
  dir.write("plan.json", plan.dump());
  EXPECT_EQ(counts_text(read_results(dir.path())), "2 done, 1 pending, 1 damaged");
  EXPECT_HAS(error_of([&] { read_results(dir / "trials"); }), "holds no trials");
}

TEST_F(TableTest, NamesCannotBreakTheFormats) {
  const std::string name = "a|b_&<\"%\n\\x,y";
  for (int seed = 1; seed <= 2; ++seed) put(trial(seed, name, seed, Json::object(), 0.1 * seed));
  const Results results = read_results(dir.path());
  const Table table = make_table(results, {});
  EXPECT_HAS(to_csv(table), "\"a|b_&<\"\"%\n\\x,y\"");
  EXPECT_HAS(to_csv(table), ",naked,mpjpe,m,0.15000000000000002,");
  EXPECT_HAS(to_tex(table, results), "a|b\\_\\&<\"\\% \\textbackslash{}x,y & 2");
  EXPECT_HAS(to_markdown(table, results), "| a\\|b_&<\"% \\x,y |");
  EXPECT_HAS(to_svg(table), "a|b_&amp;&lt;&quot;% \\x,y");
  EXPECT_EQ(to_svg(table).find("script"), std::string::npos);
  EXPECT_EQ(to_format(table, results, "x.csv"), to_csv(table));
  EXPECT_HAS(error_of([&] { to_format(table, results, "x.pdf"); }), ".svg");
}

TEST_F(TableTest, ReferencesOfAllTrialsAreRowsOfTheirOwn) {
  int i = 0;
  for (const char* name : {"quaternion", "6D"})
    for (int seed = 1; seed <= 2; ++seed) {
      ++i;
      Json one = trial(i, name, seed, Json::object(), 0.1 * i);
      Json copied = trial(i, name, seed, Json::object(), 0.15)["metrics"]["naked"];
      Json noisy = trial(i, name, seed, Json::object(), 0.05 * i)["metrics"]["naked"];
      one["metrics"]["naked"]["references"] = {{"source_unchanged", copied},
                                               {"closed_form", noisy}};
      put(one);
    }
  TableOptions options;
  options.against = "source unchanged";
  const Table table = make_table(read_results(dir.path()), options);
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_EQ(table.references, 2u);
  EXPECT_EQ(table.rows[2].label, "closed form");
  EXPECT_EQ(table.rows[2].cells[0][0].value.n, 4);
  EXPECT_NEAR(*table.rows[2].cells[0][0].value.mean, 0.125, 1e-12);
  // Measured by every trial, and the same each time: once.
  EXPECT_EQ(table.rows[3].cells[0][0].value.n, 1);
  EXPECT_FALSE(table.rows[3].cells[0][0].value.deviation);
  // A learned row is compared with the reference of its own trials, pair by pair.
  EXPECT_EQ(table.rows[1].label, "quaternion");
  EXPECT_EQ(table.rows[1].cells[0][0].difference->n, 2);
  EXPECT_NEAR(*table.rows[1].cells[0][0].difference->mean, 0, 1e-12);
  EXPECT_NEAR(*table.rows[0].cells[0][0].difference->mean, 0.2, 1e-12);
  const Results results = read_results(dir.path());
  const Json json = to_json(table, results);
  EXPECT_EQ(json["rows"].size(), 2u);
  EXPECT_EQ(json["references"].size(), 2u);
  // It is told that an average of what rows were measured beside is one, and what it was beside
  // each.
  ASSERT_EQ(table.notices.size(), 3u);
  EXPECT_HAS(table.notices[0], "averages: 'closed form on naked'; --against");
  EXPECT_HAS(table.notices[1], "two trials stand behind '6D', 'quaternion': with n = 2");
  EXPECT_HAS(table.notices[2], "fewer than five trials stand behind");
  const auto by_case = reference_by_case(results, "naked", "closed form");
  EXPECT_NEAR(by_case.at("quaternion").at("mpjpe"), 0.075, 1e-12);
  EXPECT_NEAR(by_case.at("6D").at("mpjpe"), 0.175, 1e-12);
  EXPECT_TRUE(reference_by_case(results, "naked", "source unchanged").empty());
}

TEST_F(TableTest, APictureIsDrawnForTheRowsOfTrials) {
  int i = 0;
  for (const double value : {0.02, 0.4}) {
    ++i;
    Json one = trial(i, i == 1 ? "6D" : "quaternion", 1, Json::object(), value);
    one["metrics"]["naked"]["references"] = {
        {"closed_form", trial(i, "", 1, Json::object(), 0.125)["metrics"]["naked"]},
        {"rest_pose", trial(i, "", 1, Json::object(), 2.5)["metrics"]["naked"]}};
    put(one);
  }
  const std::string svg = to_svg(make_table(read_results(dir.path()), {}));
  EXPECT_HAS(svg, ">2.5 →</text>");
  EXPECT_EQ(svg.find("0.125 →"), std::string::npos);
  // The axis begins below zero, which has no sign.
  EXPECT_HAS(svg, "fill=\"#555\">0</text>");
  EXPECT_EQ(svg.find(">-0</text>"), std::string::npos);
}

TEST_F(TableTest, NumbersOfAnAxisDoNotOverlap) {
  int i = 0;
  for (const double value : {0.000092, 0.000116}) {
    ++i;
    Json one = trial(i, std::to_string(i), 1, Json::object(), value);
    one["metrics"]["naked"]["sequences"] = Json::array();
    put(one);
  }
  const std::string svg = to_svg(make_table(read_results(dir.path()), {}));
  const std::regex number(
      "<text x=\"([0-9.]+)\"[^>]*font-size=\"10\" fill=\"#555\">([0-9.e-]+)</text>");
  double written = 0;
  int found = 0;
  for (std::sregex_iterator at(svg.begin(), svg.end(), number), end; at != end; ++at, ++found) {
    const double half = 3.0 * static_cast<double>((*at)[2].length());
    EXPECT_GE(std::stod((*at)[1]) - half, written) << at->str();
    written = std::stod((*at)[1]) + half;
  }
  EXPECT_GE(found, 2);
}

TEST_F(TableTest, OurOwnBenchmarkCanBeRead) {
  const std::string folder = std::string(RESTAGE_SOURCE_DIR) + "/experiments/studies/benchmark";
  const Table table = make_table(read_results(folder), {});
  ASSERT_EQ(table.rows.size(), 5u);
  EXPECT_EQ(table.rows[0].label, "Restage lite");
  EXPECT_EQ(table.rows[0].n, 3);
  EXPECT_EQ(table.sets.size(), 4u);
  EXPECT_NEAR(*table.rows[0].cells[1][1].value.mean, 0.0285, 5e-5);  // naked, PA-MPJPE
}

}  // namespace
}  // namespace restage::tables
