// restage benchmark: answers of any program to the open benchmark, as a row of its table.
#include <algorithm>
#include <filesystem>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/readers/sha256.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/evaluation/benchmark_answers.h"
#include "experiments/slow_work.h"
#include "experiments/sweep/benchmark_row.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/sweep/trial_work.h"

#ifndef RESTAGE_VERSION
#define RESTAGE_VERSION "unknown"
#endif

namespace restage::cli {
namespace {

namespace fs = std::filesystem;
using SeedMetrics = std::vector<std::pair<uint64_t, Json>>;

constexpr const char* kAllSets = "test,naked,clothed,scans";

struct ScoreArguments {
  std::vector<std::string> answers, sets, refused, columns;
  std::vector<int64_t> seeds;
  std::string benchmark, method, told, date, note, chosen_case, format = "md", out, row;
};

std::string manifest_of(const std::string& benchmark) {
  return (fs::path(benchmark) / kManifestName).string();
}

bool is_date(const std::string& text) {
  constexpr std::string_view kDigits = "0123456789";
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return false;
  for (const size_t i : {0, 1, 2, 3, 5, 6, 8, 9})
    if (kDigits.find(text[i]) == std::string_view::npos) return false;
  const int month = std::stoi(text.substr(5, 2)), day = std::stoi(text.substr(8, 2));
  return month >= 1 && month <= 12 && day >= 1 && day <= 31;
}

/// Result files of a sweep instead of folders of answers.
bool of_files(const ScoreArguments& a) {
  size_t folders = 0;
  for (const std::string& name : a.answers) {
    std::error_code ignored;
    if (!fs::exists(name, ignored))
      throw InputError(name, "is not there",
                       "give folders of answers, or result.json files of a sweep's trials");
    folders += fs::is_directory(name, ignored) ? 1 : 0;
  }
  if (folders != 0 && folders != a.answers.size())
    throw InputError("", "folders of answers and result files do not go together",
                     "measure them one after the other");
  return folders == 0;
}

void check_score(const ScoreArguments& a, bool files) {
  const auto wrong = [](const std::string& what, const std::string& mend) {
    throw InputError("", what, mend);
  };
  if (!files && a.benchmark.empty())
    wrong("--benchmark is missing", "give the folder that 'restage data build' made");
  if (files && (!a.benchmark.empty() || !a.seeds.empty() || !a.refused.empty()))
    wrong(std::string(!a.benchmark.empty() ? "--benchmark"
                      : !a.seeds.empty()   ? "--seeds"
                                           : "--refused") +
              " goes with folders of answers only",
          "leave it out: result files say it");
  if (!files && !a.chosen_case.empty()) wrong("--case goes with result files only", "leave it out");
  if (!a.seeds.empty() && a.seeds.size() != a.answers.size())
    wrong("--seeds has " + counted(a.seeds.size(), "number") + " for " +
              counted(a.answers.size(), "folder"),
          "give one for each folder");
  for (const int64_t seed : a.seeds)
    if (seed < 0 || std::count(a.seeds.begin(), a.seeds.end(), seed) > 1)
      wrong("--seeds has " + std::to_string(seed) + (seed < 0 ? "" : " twice"),
            "give different numbers from 0");
  if (!a.date.empty() && !is_date(a.date))
    wrong("--date '" + a.date.substr(0, 40) + "' is no date", "write it as 2026-01-31");
  if (!a.row.empty() && a.method.empty())
    wrong("--row needs --method", "say whose row it is: --method 'Our network'");
  if (!a.out.empty()) tables::to_format({}, {}, a.out);  // is the ending known?
}

std::vector<std::string> sets_asked(const ScoreArguments& a) {
  if (!a.sets.empty()) return a.sets;
  std::vector<std::string> out;
  std::istringstream words(kAllSets);
  for (std::string word; std::getline(words, word, ',');) out.push_back(word);
  return out;
}

// ---- folders of answers -------------------------------------------------------------------------

SeedMetrics measured_answers(const ScoreArguments& a, const AnswersAsked& asked) {
  SlowWork slow;
  slow.on("reading the benchmark");
  check_asked(asked);
  for (const std::string& folder : a.answers) check_answers(folder, asked);
  SeedMetrics out;
  for (size_t i = 0; i < a.answers.size(); ++i) {
    Json metrics = Json::object();
    for (const std::string& set : asked.sets) {
      slow.on("measuring " + a.answers[i] + " on the set '" + set + "'");
      std::vector<std::string> names;
      const SystemScores scores =
          score_answers(a.answers[i], asked, set, metrics::recorded(), &names);
      metrics[set] = sweep::set_json(scores, names);
    }
    out.emplace_back(a.seeds.empty() ? i + 1 : static_cast<uint64_t>(a.seeds[i]),
                     std::move(metrics));
  }
  return out;
}

// ---- results of a sweep -------------------------------------------------------------------------

[[noreturn]] void refuse_cases(const std::vector<std::string>& cases) {
  throw InputError("",
                   "these trials are of " + counted(cases.size(), "case") + ": " + joined(cases),
                   "choose one with --case");
}

SeedMetrics told_results(const ScoreArguments& a) {
  SeedMetrics out;
  std::vector<std::string> cases;
  for (const std::string& path : a.answers) {
    const sweep::JsonReader<nlohmann::json> reader(path, "give result.json files of trials");
    const nlohmann::json sorted = reader.parse();
    const tables::TrialResult trial = tables::parse_result(sorted, path, reader.text(sorted, "id"));
    if (std::find(cases.begin(), cases.end(), trial.case_name) == cases.end())
      cases.push_back(trial.case_name);
    if (!a.chosen_case.empty() && trial.case_name != a.chosen_case) continue;
    if (a.chosen_case.empty() && cases.size() > 1) continue;  // they are refused below
    if (trial.state != tables::TrialState::done) reader.fail("is of a trial that is not done");
    for (const auto& [seed, metrics] : out)
      if (seed == trial.seed) reader.fail("is a second trial of seed " + std::to_string(seed));
    Json metrics = Json::object();
    for (const std::string& set : sets_asked(a))
      if (const auto found = sorted["metrics"].find(set); found != sorted["metrics"].end())
        metrics[set] = Json::parse(found->dump());
    if (metrics.empty()) reader.fail("has none of the benchmark's sets");
    out.emplace_back(trial.seed, std::move(metrics));
  }
  if (a.chosen_case.empty() && cases.size() > 1) refuse_cases(cases);
  if (out.empty())
    throw InputError("", "no trial has the case '" + a.chosen_case + "'",
                     "the cases are: " + joined(cases));
  std::sort(out.begin(), out.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
  return out;
}

// ---- the row ------------------------------------------------------------------------------------

tables::RowFacts row_facts(const ScoreArguments& a, bool files) {
  tables::RowFacts out;
  std::string name = a.answers.front();
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  out.method = !a.method.empty() ? a.method
               : files           ? "these trials"
                                 : fs::path(name).filename().string();
  out.told = a.told;
  out.date = a.date;
  out.note = a.note;
  out.refused = a.refused;
  if (files) return out;  // which program measured, and on which build, they do not say
  out.restage = RESTAGE_VERSION;
  out.protocol = read_manifest(a.benchmark).protocol;
  out.checksum = sha256_of_file(manifest_of(a.benchmark));
  return out;
}

std::string printed_table(const ScoreArguments& a, const tables::Table& table,
                          const tables::Results& results) {
  return tables::to_format(table, results, "table." + a.format);
}

int run_score(const ScoreArguments& a, const Common& common) {
  const bool files = of_files(a);
  check_score(a, files);
  std::vector<std::string> inputs = a.answers;
  if (!files) inputs.push_back(manifest_of(a.benchmark));
  for (const std::string& file : {a.out, a.row})
    if (!file.empty()) check_output(file, inputs);
  const SeedMetrics metrics =
      files ? told_results(a) : measured_answers(a, {a.benchmark, sets_asked(a), a.refused});
  const Json document = tables::row_document(row_facts(a, files), metrics);
  const tables::BenchmarkRow row =
      tables::parse_row(nlohmann::json::parse(document.dump()), "the row");
  tables::TableOptions options{.rows = {"case"}, .columns = a.columns};
  tables::Table table = tables::make_table(row.results, options);
  if (table.references > 0) {
    options.against = "source unchanged";
    table = tables::make_table(row.results, options);
  }
  if (!a.out.empty()) write_file_atomically(a.out, tables::to_format(table, row.results, a.out));
  if (!a.row.empty()) write_file_atomically(a.row, document.dump(1) + "\n");
  for (const std::string& notice : table.notices) log_warning(on_one_line(notice));
  if (common.json)
    print_json({{"row", document}, {"table", tables::to_json(table, row.results)}});
  else
    print(printed_table(a, table, row.results));
  for (const std::string& file : {a.out, a.row})
    if (!file.empty()) log_info("wrote " + file);
  return 0;
}

void add_score(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "score", "one row of the benchmark's table, from answers of any program",
      "restage benchmark score answers/ --benchmark benchmark\n"
      "restage benchmark score seed1/ seed2/ seed3/ --benchmark benchmark --method 'Our network' "
      "--told clouds --date 2026-01-31 --row ours.json\n"
      "restage benchmark score seed4/ seed5/ --benchmark benchmark --seeds 4,5 --columns "
      "pa_mpjpe,pa_mpvd --note 'half of the data'\n"
      "restage benchmark score answers/ --benchmark benchmark --sets naked,clothed --refused "
      "clothed/walking-worker-female --out table.tex\n"
      "restage benchmark score runs/sweep/trials/*/result.json --case lite --method 'Ours, lite' "
      "--row lite.json --format csv",
      run_score);
  app.add_option("ANSWERS", a.answers,
                 "a folder for each seed, with SET/NAME.h5 or folders of meshes SET/NAME/; or "
                 "result.json files of a sweep's trials")
      .required();
  app.add_option("--benchmark", a.benchmark, "the folder that 'restage data build' made");
  app.add_option("--sets", a.sets, std::string("sets to measure (default: ") + kAllSets + ")")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--refused", a.refused, "SET/NAME,... that the method gives no answer to")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--seeds", a.seeds, "seed of each folder (default: 1,2,...)")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--method", a.method, "name of the row");
  app.add_option("--told", a.told, "what it knows of source and target, such as 'clouds'");
  app.add_option("--date", a.date, "when it was measured, as 2026-01-31");
  app.add_option("--note", a.note, "a remark, such as the address of its code");
  app.add_option("--case", a.chosen_case, "of result files: those of this case");
  app.add_option("--columns", a.columns, "METRIC,... to show (default: the papers')")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--format", a.format, "of what is printed").one_of({"md", "csv", "tex"});
  app.add_option("--out", a.out, "F.md, F.csv, F.tex or F.svg to write");
  app.add_option("--row", a.row, "F.json, the row with all that a leaderboard needs");
}

// ---- sequences ----------------------------------------------------------------------------------

struct SequencesArguments {
  std::string benchmark, set = "test", out;
  bool truth = false;
};

int run_sequences(const SequencesArguments& a, const Common& common) {
  read_manifest(a.benchmark);
  std::error_code ignored;
  if (fs::exists(fs::path(a.out) / a.set, ignored))
    throw InputError((fs::path(a.out) / a.set).string(), "is there already",
                     "remove it, or give another --out");
  SlowWork slow;
  slow.on("making the sequences of '" + a.set + "'");
  const std::vector<std::string> names =
      write_benchmark_sequences(a.benchmark, a.set, a.out, a.truth);
  print(common.json, {{"out", a.out}, {"set", a.set}, {"sequences", names}},
        "wrote " + counted(names.size(), "sequence") + " to " + (fs::path(a.out) / a.set).string() +
            "\n");
  return 0;
}

void add_sequences(Program& program, CommandOptions group) {
  auto [app, a] = program.add(group, "sequences",
                              "the clouds and targets of a set that the benchmark makes when asked",
                              "restage benchmark sequences benchmark --out made\n"
                              "restage benchmark sequences benchmark --set seen --truth --out made",
                              run_sequences);
  app.add_option("BENCHMARK", a.benchmark, "the folder that 'restage data build' made").required();
  app.add_option("--set", a.set, "more motions, or motions that trainings see")
      .one_of({"test", "seen"});
  app.add_flag("--truth", a.truth, "with truth.h5 in each folder (of test 1.3 GB)");
  app.add_option("--out", a.out, "folder to write SET/NAME/{source.h5,target.ply,rest.h5} to")
      .required();
}

// ---- the leaderboard ----------------------------------------------------------------------------

struct LeaderboardArguments {
  std::vector<std::string> rows;
  std::string out;
};

int run_leaderboard(const LeaderboardArguments& a, const Common& common) {
  if (!a.out.empty()) check_output(a.out, a.rows);
  std::vector<tables::BenchmarkRow> rows;
  for (const std::string& path : a.rows) rows.push_back(tables::read_row(path));
  const std::string page = tables::leaderboard_markdown(rows);
  if (!a.out.empty()) write_file_atomically(a.out, page);
  if (a.out.empty() || common.json)
    print(common.json, {{"rows", a.rows}, {"page", page}}, page);
  else
    log_info("wrote " + a.out);
  return 0;
}

void add_leaderboard(Program& program, CommandOptions group) {
  auto [app, a] =
      program.add(group, "leaderboard", "a page of all rows, in Markdown",
                  "restage benchmark leaderboard rows/*.json --out page.md", run_leaderboard);
  app.add_option("ROW", a.rows, "files of 'restage benchmark score --row'").required();
  app.add_option("--out", a.out, "F.md to write").one_at_a_time();
}

}  // namespace

void add_benchmark(Program& program) {
  CommandOptions group =
      program.add_group("benchmark", "measure answers to the open benchmark, and compare rows");
  add_sequences(program, group);
  add_score(program, group);
  add_leaderboard(program, group);
}

}  // namespace restage::cli
