#include "experiments/sweep/benchmark_row.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "experiments/sweep/table.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/text.h"

namespace restage::tables {
namespace {

using Json = nlohmann::ordered_json;
using SortedJson = nlohmann::json;
using RowReader = sweep::JsonReader<SortedJson>;

constexpr const char* kRowFormat = "restage-benchmark-row-1";
constexpr const char* kRowMend = "make it again with 'restage benchmark score ... --row FILE'";

Json or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

// ---- writing -----------------------------------------------------------------------------------

Json kept_of(const Json& object, std::initializer_list<const char*> names) {
  Json out = Json::object();
  for (const char* name : names)
    if (object.contains(name)) out[name] = object[name];
  return out;
}

/// A set without what a row has no use for: the joints one by one, the surest frames.
Json kept_set(const Json& set, const Json& before) {
  Json out = kept_of(set, {"mean", "sequences"});
  const auto references = set.find("references");
  if (references == set.end()) return out;
  Json kept = Json::object();
  for (const auto& [name, scores] : references->items())
    kept[name] = kept_of(scores, {"mean", "sequences"});
  if (kept != before) out["references"] = std::move(kept);
  return out;
}

// ---- the page ----------------------------------------------------------------------------------

/// A table of the page.
struct Figure {
  const char *heading, *metric, *unit;
  double factor;  ///< from the metric's unit
  int digits;
};
constexpr Figure kFigures[] = {{"Joints: PA-MPJPE", "pa_mpjpe", "mm", 1e3, 1},
                               {"Joints, not aligned: MPJPE", "mpjpe", "mm", 1e3, 1},
                               {"Surface: PA-MPVD", "pa_mpvd", "mm", 1e3, 1},
                               {"Surface, not aligned: MPVD", "mpvd", "mm", 1e3, 1},
                               {"Local shape: MEDL", "medl", "mm", 1, 2},
                               {"Calm: Acc", "acc", "mm per frame²", 1e3, 1}};
constexpr const char* kUnchanged = "source unchanged";

std::string title_of(const std::string& set) {
  if (set == "test") return "more motions";
  if (set == "seen") return "seen motions";
  return set;
}

std::string in_unit(double value, const Figure& figure, bool sign = false) {
  return format(sign ? "%+.*f" : "%.*f", figure.digits, value * figure.factor);
}

std::string estimate_text(const Estimate& e, const Figure& figure, bool sign = false) {
  if (!e.mean) return "-";
  std::string out = in_unit(*e.mean, figure, sign);
  if (e.deviation) out += " ± " + in_unit(*e.deviation, figure);
  if (e.low)
    out += " [" + in_unit(*e.low, figure, sign) + ", " + in_unit(*e.high, figure, sign) + "]";
  return out;
}

/// The sets in the order of the benchmark's page.
std::vector<size_t> order_of_sets(const Table& table) {
  std::vector<size_t> out;
  for (const char* set : {"test", "seen", "naked", "clothed", "scans"})
    for (size_t s = 0; s < table.sets.size(); ++s)
      if (table.sets[s] == set) out.push_back(s);
  for (size_t s = 0; s < table.sets.size(); ++s)
    if (std::find(out.begin(), out.end(), s) == out.end()) out.push_back(s);
  return out;
}

using CellText = std::function<std::string(const Row& row, size_t set)>;

/// Rows without a single figure are left out.
std::string figure_table(const Table& table, bool references, const CellText& text) {
  const std::vector<size_t> sets = order_of_sets(table);
  std::vector<std::vector<std::string>> rows{{"", "seeds"}};
  for (const size_t s : sets) rows[0].push_back(for_markdown(title_of(table.sets[s])));
  for (const Row& row : table.rows) {
    if (row.reference && !references) continue;
    std::vector<std::string> line{row.reference ? "*" + row.label + "*" : for_markdown(row.label),
                                  row.reference ? "" : std::to_string(row.n)};
    for (const size_t s : sets) line.push_back(text(row, s));
    if (std::any_of(line.begin() + 2, line.end(), [](const auto& cell) { return cell != "-"; }))
      rows.push_back(std::move(line));
  }
  return rows.size() == 1 ? "" : markdown_table(rows);
}

/// "not recorded" is said once, by a dash.
std::string facts_table(const std::vector<const BenchmarkRow*>& rows) {
  std::vector<std::vector<std::string>> lines{
      {"method", "is told", "date", "Restage", "benchmark", "without an answer", "remarks"}};
  const auto cell = [](const std::string& text) { return text.empty() ? "-" : for_markdown(text); };
  for (const BenchmarkRow* row : rows)
    lines.push_back({for_markdown(row->method), cell(row->told), cell(row->date),
                     cell(row->restage), cell(row->checksum.substr(0, 12)),
                     cell(joined(row->refused)), cell(row->note)});
  return markdown_table(lines);
}

/// What sorts a row: first those with most sets, then the mean of their PA-MPJPE.
std::pair<size_t, double> rank_of(const BenchmarkRow& row) {
  std::map<std::string, std::vector<double>> values;
  for (const TrialResult& trial : row.results.trials)
    for (const auto& [name, set] : trial.sets)
      if (const auto found = set.mean.find("pa_mpjpe"); found != set.mean.end())
        values[name].push_back(found->second);
  double sum = 0;
  for (const auto& [name, list] : values) {
    double of_set = 0;
    for (const double value : list) of_set += value;
    sum += of_set / static_cast<double>(list.size());
  }
  constexpr size_t kMany = 1000;
  return {kMany - values.size(), values.empty() ? std::numeric_limits<double>::infinity()
                                                : sum / static_cast<double>(values.size())};
}

/// In the page's order.
std::vector<const BenchmarkRow*> ranked(const std::vector<BenchmarkRow>& rows) {
  std::vector<const BenchmarkRow*> out;
  for (const BenchmarkRow& row : rows) out.push_back(&row);
  std::stable_sort(out.begin(), out.end(), [](const BenchmarkRow* a, const BenchmarkRow* b) {
    return rank_of(*a) < rank_of(*b);
  });
  for (size_t i = 0; i < out.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (out[k]->method == out[i]->method)
        throw InputError(out[i]->path, "is a second row of '" + out[i]->method + "'",
                         "leave one out, or give it another --method");
  return out;
}

std::string builds_note(const std::vector<const BenchmarkRow*>& rows) {
  std::vector<std::string> builds;
  for (const BenchmarkRow* row : rows)
    if (!row->checksum.empty() &&
        std::find(builds.begin(), builds.end(), row->checksum) == builds.end())
      builds.push_back(row->checksum);
  return builds.size() < 2 ? ""
                           : "\nThese rows are of " + std::to_string(builds.size()) +
                                 " builds of the benchmark, whose files are not the same bytes.\n";
}

/// A method that leaves frames out is measured on other frames than the references.
bool same_frames(const SetResult& a, const SetResult& b) {
  if (a.sequences.size() != b.sequences.size() || a.frames != b.frames) return false;
  for (size_t i = 0; i < a.sequences.size(); ++i)
    if (a.sequences[i].first != b.sequences[i].first) return false;
  return true;
}

}  // namespace

void share_references(Results* results) {
  std::map<std::string, SetResult> first;
  for (const TrialResult& trial : results->trials)
    for (const auto& [name, set] : trial.sets)
      if (!set.references.empty()) first.try_emplace(name, set);
  for (TrialResult& trial : results->trials)
    for (auto& [name, set] : trial.sets)
      if (const auto found = first.find(name);
          found != first.end() && same_frames(set, found->second))
        set.references = found->second.references;
}

Json row_document(const RowFacts& facts, const std::vector<std::pair<uint64_t, Json>>& trials) {
  Json out = {
      {"format", kRowFormat},
      {"method", facts.method},
      {"told", or_null(facts.told)},
      {"date", or_null(facts.date)},
      {"note", or_null(facts.note)},
      {"restage", or_null(facts.restage)},
      {"benchmark", {{"protocol", or_null(facts.protocol)}, {"sha256", or_null(facts.checksum)}}},
      {"refused", facts.refused},
      {"trials", Json::array()}};
  std::map<std::string, Json> references;
  for (const auto& [seed, metrics] : trials) {
    Json sets = Json::object();
    for (const auto& [name, set] : metrics.items()) {
      sets[name] = kept_set(set, references[name]);
      if (sets[name].contains("references")) references[name] = sets[name]["references"];
    }
    out["trials"].push_back({{"seed", seed}, {"metrics", std::move(sets)}});
  }
  return out;
}

BenchmarkRow parse_row(const SortedJson& document, const std::string& path) {
  const RowReader reader(path, kRowMend);
  if (reader.optional_text(document, "format") != kRowFormat)
    reader.fail("is no row of the benchmark");
  BenchmarkRow out;
  out.path = path;
  out.method = reader.text(document, "method");
  out.told = reader.optional_text(document, "told");
  out.date = reader.optional_text(document, "date");
  out.note = reader.optional_text(document, "note");
  out.restage = reader.optional_text(document, "restage");
  const SortedJson& benchmark = reader.section(document, "benchmark");
  out.protocol = reader.optional_text(benchmark, "protocol");
  out.checksum = reader.optional_text(benchmark, "sha256");
  for (const SortedJson& name : reader.list(document, "refused")) {
    reader.need(name.is_string(), "refused", "a list of names");
    out.refused.push_back(name.get<std::string>());
  }
  for (const SortedJson& entry : reader.list(document, "trials")) {
    reader.need(entry.is_object(), "trials", "a list of sections");
    TrialResult trial;
    trial.case_name = out.method;
    trial.seed = reader.count(entry, "seed");
    trial.state = TrialState::done;
    trial.sets = parse_sets(reader.section(entry, "metrics"), path, kRowMend);
    out.results.trials.push_back(std::move(trial));
  }
  if (out.results.trials.empty()) reader.fail("holds no trial");
  share_references(&out.results);
  return out;
}

BenchmarkRow read_row(const std::string& path) {
  return parse_row(RowReader(path, kRowMend).parse(), path);
}

std::string leaderboard_markdown(const std::vector<BenchmarkRow>& rows) {
  const std::vector<const BenchmarkRow*> order = ranked(rows);
  Results all;
  for (const BenchmarkRow* row : order)
    all.trials.insert(all.trials.end(), row->results.trials.begin(), row->results.trials.end());
  share_references(&all);
  TableOptions options{.rows = {"case"}};
  for (const Figure& figure : kFigures) options.columns.emplace_back(figure.metric);
  Table table = make_table(all, options);
  const auto unchanged = std::find_if(table.rows.begin(), table.rows.end(), [](const Row& row) {
    return row.reference && row.label == kUnchanged;
  });
  if (unchanged != table.rows.end()) {
    options.against = kUnchanged;
    table = make_table(all, options);
  }
  std::string text =
      "# Leaderboard\n\n<!-- Written by 'restage benchmark leaderboard' from files of rows. "
      "Change the rows, not this page. -->\n\n"
      "Methods on the sets of the open benchmark. Less is better. A cell has the mean, ± the "
      "sample deviation of the\nseeds, and [the 95 % interval over seeds and sequences]. Rows in "
      "*italics* learn nothing and know true joints.\nIntervals of two rows may overlap although "
      "the rows differ: the last figures are paired differences.\n";
  for (size_t c = 0; c < std::size(kFigures); ++c) {
    const Figure& figure = kFigures[c];
    const std::string body = figure_table(table, true, [&](const Row& row, size_t s) {
      return estimate_text(row.cells[s][c].value, figure);
    });
    if (!body.empty())
      text += std::string("\n## ") + figure.heading + ", " + figure.unit + "\n\n" + body;
  }
  if (table.against) {
    const std::string body = figure_table(table, false, [&](const Row& row, size_t s) {
      return estimate_text(row.cells[s][0].difference.value_or(Estimate{}), kFigures[0], true);
    });
    text +=
        "\n## Difference to \"source unchanged\": PA-MPJPE, mm\n\nPaired by sequence. Below "
        "zero is better than handing on the source's true joints.\n\n" +
        body;
  }
  return text +
         "\n## Where the rows are from\n\nThe benchmark is the beginning of the SHA-256 of its "
         "manifest.json. A dash: not recorded.\n\n" +
         facts_table(order) + builds_note(order);
}

}  // namespace restage::tables
