#include "experiments/reproduce/page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string_view>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "experiments/reproduce/page_text.h"
#include "experiments/sweep/svg.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/text.h"
#include "train/progress.h"

namespace restage::reproduce {
namespace {

namespace fs = std::filesystem;
using tables::Estimate;
using tables::Results;
using tables::Table;

constexpr size_t kWorst = 5;

std::string heading(const metrics::Metric& metric) {
  return std::string(metric.title) + " [" + metric.unit + "]";
}

const tables::Row* row_of(const Table& table, const std::string& label) {
  for (const tables::Row& row : table.rows)
    if (row.label == label) return &row;
  return nullptr;
}

std::optional<size_t> set_of(const Table& table, const std::string& name) {
  for (size_t s = 0; s < table.sets.size(); ++s)
    if (table.sets[s] == name) return s;
  return std::nullopt;
}

/// As it may be typed; quotes only where a shell would make something else of a word.
std::string typed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    const bool plain = std::all_of(word.begin(), word.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 ||
             std::string_view("_-./=,:+").find(char(c)) != std::string::npos;
    });
    text += (text.empty() ? "" : " ") + (plain ? on_one_line(word) : shell_word(on_one_line(word)));
  }
  return text;
}

std::string sweep_command(const Found& f, const Budget& budget) {
  std::vector<std::string> words = {"restage", "sweep", "run", f.evidence.sweep_file(budget)};
  words.insert(words.end(), budget.words.begin(), budget.words.end());
  words.insert(words.end(), {"--out", "runs/" + f.evidence.name});
  return typed(words);
}

// ---- a table -----------------------------------------------------------------------------------

/// The paper's line and ours of every row, then what needs no learning: once, or, if it sees what
/// the row sees, below each.
Rows beside_each_other(const PaperTable& printed, const Results& results, const Table& table,
                       const std::string& set_name) {
  Rows rows{{"", "n"}};
  for (const auto* metric : table.columns) rows[0].push_back(heading(*metric));
  const auto set = set_of(table, set_name);
  std::vector<std::pair<const tables::Row*, std::map<std::string, tables::MetricValues>>>
      references;
  for (const tables::Row& row : table.rows)
    if (row.reference && set)
      references.emplace_back(&row, tables::reference_by_case(results, set_name, row.label));
  for (const PaperRow& row : printed.rows) {
    if (!row.printed.empty()) {
      auto& paper = rows.emplace_back(
          Rows::value_type{(row.printed_as.empty() ? row.row : row.printed_as) + " (paper)", ""});
      for (size_t c = 0; c < table.columns.size(); ++c)
        paper.push_back(c < row.printed.size() ? number(row.printed[c]) : "");
    }
    const tables::Row* ours = row_of(table, row.row);
    auto& line = rows.emplace_back(Rows::value_type{
        "**" + row.row + "**", ours != nullptr ? std::to_string(ours->n) : "not run"});
    for (size_t c = 0; c < table.columns.size(); ++c)
      line.push_back(ours != nullptr && set ? with_interval(ours->cells[*set][c].value) : "-");
    for (const auto& [reference, by_case] : references) {
      const auto own = ours != nullptr ? by_case.find(ours->case_name) : by_case.end();
      if (own == by_case.end()) continue;
      auto& below = rows.emplace_back(
          Rows::value_type{row.row + ": " + reference->label + " (learns nothing)", ""});
      for (const auto* metric : table.columns) {
        const auto value = own->second.find(metric->name);
        below.push_back(value != own->second.end() ? tables::short_number(value->second) : "-");
      }
    }
  }
  for (const auto& [row, by_case] : references) {
    if (!by_case.empty()) continue;
    auto& line = rows.emplace_back(Rows::value_type{row->label + " (learns nothing)", ""});
    for (size_t c = 0; c < table.columns.size(); ++c)
      line.push_back(number(row->cells[*set][c].value.mean));
  }
  return rows;
}

std::string reasons(const PaperTable& printed) {
  std::string text;
  for (const PaperRow& row : printed.rows)
    if (!row.not_run.empty()) text += "* " + row.row + " is not run: " + row.not_run + "\n";
  return text.empty() ? "" : "\n" + text;
}

// ---- what the paper does not ask ---------------------------------------------------------------

/// Averages of values that many trials give.
class Averages {
 public:
  void add(const std::string& name, double value) {
    sums_[name].first += value;
    ++sums_[name].second;
  }
  std::map<std::string, double> means() const {
    std::map<std::string, double> out;
    for (const auto& [name, sum] : sums_) out[name] = sum.first / sum.second;
    return out;
  }

 private:
  std::map<std::string, std::pair<double, int>> sums_;
};

/// PA-MPJPE of one row on one set over its seeds: by sequence, by the motion that a sequence's name
/// begins with and its length, by the bodies that it ends with, by joint.
struct Parts {
  std::map<std::string, double> sequences, motions, bodies, joints;
};

std::string motion_of(const std::string& sequence, const tables::SetResult& scores) {
  const std::string name = sequence.substr(0, sequence.find_first_of("-@:"));
  const auto frames = scores.frames.find(sequence);
  return frames == scores.frames.end() ? name
                                       : name + ", " + std::to_string(frames->second) + " frames";
}

std::string bodies_of(const std::string& sequence) {
  const size_t at = sequence.find_first_of("-:");
  return at == std::string::npos ? sequence : sequence.substr(at + 1);
}

Parts parts_of(const Results& results, const std::string& set, const tables::Row& row) {
  Averages sequences, motions, bodies, joints;
  for (const tables::TrialResult& trial : results.trials) {
    if (trial.case_name != row.case_name) continue;
    for (const auto& [name, scores] : trial.sets) {
      if (name != set) continue;
      for (const auto& [sequence, values] : scores.sequences)
        if (const auto found = values.find("pa_mpjpe"); found != values.end()) {
          sequences.add(sequence, found->second);
          motions.add(motion_of(sequence, scores), found->second);
          bodies.add(bodies_of(sequence), found->second);
        }
      for (const auto& [joint, value] : scores.joints) joints.add(joint, value);
    }
  }
  return {sequences.means(), motions.means(), bodies.means(), joints.means()};
}

std::string in_mm(double metres) { return tables::short_number(std::round(1e4 * metres) / 10); }

/// A line for each name, a column for each row.
std::string split_table(const std::string& what, const std::vector<std::string>& labels,
                        const std::vector<std::map<std::string, double>>& columns) {
  std::map<std::string, std::vector<std::string>> lines;
  for (size_t c = 0; c < columns.size(); ++c)
    for (const auto& [name, value] : columns[c]) {
      auto& line = lines.try_emplace(name, columns.size(), "-").first->second;
      line[c] = in_mm(value);
    }
  if (lines.empty()) return "";
  Rows rows{{what}};
  rows[0].insert(rows[0].end(), labels.begin(), labels.end());
  for (const auto& [name, line] : lines) {
    rows.push_back({name});
    rows.back().insert(rows.back().end(), line.begin(), line.end());
  }
  return table_text(rows) + "\n";
}

std::string worst_text(const std::string& label, const std::map<std::string, double>& sequences) {
  std::vector<std::pair<double, std::string>> all;
  for (const auto& [name, value] : sequences) all.emplace_back(value, name);
  std::sort(all.rbegin(), all.rend());
  if (all.size() < 2) return "";
  const auto shown = [](const auto& one) { return one.second + " " + in_mm(one.first); };
  return "Worst sequences of " + label + ": " +
         joined(std::span(all).first(std::min(kWorst, all.size())), shown) +
         "; the best: " + shown(all.back()) + ".\n\n";
}

/// Where the errors on a set are: by motion, bodies and joint, the worst sequences. Folded, since
/// it is long.
std::string where_text(const Results& results, const PaperTable& printed, const std::string& set,
                       const Table& table) {
  std::vector<std::string> labels;
  std::vector<std::map<std::string, double>> motions, bodies, joints;
  std::string worst;
  for (const PaperRow& asked : printed.rows) {
    const tables::Row* row = row_of(table, asked.row);
    if (row == nullptr || row->n == 0) continue;
    const Parts parts = parts_of(results, set, *row);
    if (parts.sequences.empty()) continue;
    labels.push_back(asked.row);
    motions.push_back(parts.motions);
    const bool shared = parts.bodies.size() < parts.sequences.size();
    bodies.push_back(shared ? parts.bodies : std::map<std::string, double>());
    joints.push_back(parts.joints);
    worst += worst_text(asked.row, parts.sequences);
  }
  if (labels.empty()) return "";
  return "<details><summary>Where the errors are on " + on_one_line(set) +
         ": PA-MPJPE in mm by motion, bodies and joint, the worst sequences</summary>\n\n" +
         split_table("motion", labels, motions) + split_table("bodies", labels, bodies) +
         split_table("joint", labels, joints) + worst + "</details>\n\n";
}

/// Examples that a trial's stages were trained on: "motion 32,000".
std::string examples_text(const tables::TrialResult& trial) {
  return joined(trial.training, [](const auto& one) {
    const auto& [stage, how] = one;
    const bool known = how.steps && how.batch;
    return cat(stage, " ", known ? std::to_string(*how.steps * *how.batch) : "?");
  });
}

/// What the trials took: together, and one of each row.
std::string effort_text(const Results& results, const Table& table) {
  double seconds = 0;
  Averages by_case;
  std::map<std::string, std::string> examples;
  for (const tables::TrialResult& trial : results.trials) {
    seconds += trial.seconds;
    if (trial.state != tables::TrialState::done) continue;
    by_case.add(trial.case_name, trial.seconds);
    examples[trial.case_name] = examples_text(trial);
  }
  const auto means = by_case.means();
  std::string rows;
  for (const tables::Row& row : table.rows) {
    const auto mean = means.find(row.case_name);
    if (row.reference || row.case_name.empty() || mean == means.end()) continue;
    rows += (rows.empty() ? " A trial of " : ", of ") + row.label + " took " +
            duration_text(mean->second);
    if (!examples[row.case_name].empty()) rows += " (examples: " + examples[row.case_name] + ")";
  }
  return "Trials: " + tables::counts_text(results) + "; " + duration_text(seconds) +
         " of work, beside whatever else the machine did." + rows +
         (rows.empty() ? "\n\n" : ".\n\n");
}

std::vector<std::string> columns_of(const PaperFile& asked) {
  std::vector<std::string> out = asked.metrics;
  for (const std::string& metric : asked.beside)
    if (std::find(out.begin(), out.end(), metric) == out.end()) out.push_back(metric);
  return out;
}

// ---- the page ----------------------------------------------------------------------------------

/// What each table is about, and what it took.
std::string tables_text(const std::vector<Found>& all, const std::string& tables,
                        const std::string& home) {
  Rows rows{{"table", "about", "experiment", "trials", "seeds", "hours"}};
  for (const Found& f : all) {
    std::set<uint64_t> seeds;
    double seconds = 0;
    for (const tables::TrialResult& trial : f.results.trials) {
      if (trial.state == tables::TrialState::done) seeds.insert(trial.seed);
      seconds += trial.seconds;
    }
    rows.push_back({link_to_table(f, tables), f.evidence.asked.title,
                    linked(f.evidence.name, home + "/" + f.evidence.name + "/README.md"),
                    tables::counts_text(f.results), std::to_string(seeds.size()),
                    format("%.1f", seconds / 3600)});
  }
  return table_text(rows) + "\n";
}

const char* const kRule =
    "## How to read it\n\nA claim is judged by paired differences over seeds and sequences: it "
    "**holds** if the 95 % interval of every\ncomparison lies on its side, **does not hold** if "
    "one "
    "lies on the other, and **cannot be told** otherwise, with fewer\nthan three seeds, or if it "
    "is "
    "not clear beside the other claims of this page (Holm). It is **not trained far enough** "
    "if\nthe "
    "last quarter of a row's steps still lowered the error by 2 %, or if the row's curve was not "
    "kept; what the intervals\nsay then stands beside it. The rule and its\namendments: "
    "`experiments/reproduce/verdict.h`. Orders are judged, never "
    "figures: data and budgets are others than the\npaper's.\n\nOurs: mean ± sample deviation over "
    "n "
    "seeds [95 % interval over seeds and sequences (docs/metrics.md)].\n\n";

/// Of what is beside the page; made if it is not there.
std::string files_folder(const std::string& folder, const PageOptions& options) {
  const std::string files = folder + "/" + options.paper;
  make_folder(files);
  return files;
}

}  // namespace

std::vector<Found> found(const std::vector<Evidence>& all, const PageOptions& options,
                         const std::string& folder) {
  std::vector<Found> out;
  for (const Evidence& evidence : all) {
    Found& one = out.emplace_back(Found{evidence, results_of(evidence)});
    const Budget& budget = evidence.asked.budget(options.budget);
    for (const Claim& claim : evidence.asked.claims)
      one.judgements.push_back(judge(evidence.asked, budget, claim, one.results));
    one.pictures = draw_pictures(evidence, one.results, files_folder(folder, options));
  }
  std::vector<Judgement*> claims;
  for (Found& one : out)
    for (Judgement& judgement : one.judgements) claims.push_back(&judgement);
  judge_together(claims);
  return out;
}

std::string page_markdown(const std::vector<Found>& all, const PageOptions& options,
                          const std::string& tables, const std::string& home) {
  return "# " + options.paper + ", run again\n\n" + claims_text(all, tables, options.budget) +
         tables_text(all, tables, home) + kRule + "Budget: " + options.budget +
         ". Made by\n\n```\n" + typed(options.command) + "\n```\n";
}

std::string table_markdown(const Found& f, const PageOptions& options, const std::string& page,
                           const std::string& home) {
  const PaperFile& asked = f.evidence.asked;
  const Budget& budget = asked.budget(options.budget);
  std::string text = "# " + options.paper + ", table " + asked.table + ": " + asked.title + "\n\n" +
                     linked(f.evidence.name, home + "/" + f.evidence.name + "/README.md") +
                     " says what is the same here and what is not. " +
                     linked("All claims, and how to read this", page) + ".";
  if (!budget.note.empty()) text += " " + budget.note;
  text += "\n\n";
  const Table table = tables::make_table(f.results, {{}, columns_of(asked), ""});
  std::string where;
  for (const PaperTable& printed : asked.tables) {
    const std::string& set = measured_set(budget, printed);
    text += "**" + printed.set + (set == printed.set ? "" : ", measured on " + set) + "**\n\n" +
            table_text(beside_each_other(printed, f.results, table, set)) + reasons(printed) + "\n";
    where += where_text(f.results, printed, set, table);
    if (!budget.set.empty()) break;
  }
  for (const std::string& says : asked.contradicted)
    text += "> " + on_one_line(says) + "\n\nNot judged: the paper's own figures say otherwise.\n\n";
  for (size_t c = 0; c < asked.claims.size(); ++c)
    text += claim_text(asked.claims[c], f.judgements[c], options.budget);
  for (const Drawn& picture : f.pictures)
    text += "!" + linked(picture.says, picture.file) + "\n\n" + on_one_line(picture.says) + "\n\n";
  text += where;
  if (f.evidence.runs()) {
    const std::string& name = f.evidence.name;
    text += effort_text(f.results, table) + "Alone: `" + sweep_command(f, budget) + "`. " +
            linked("CSV", name + ".csv") + ", " + linked("LaTeX", name + ".tex") + ", " +
            linked("SVG", name + ".svg") + ".\n";
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

nlohmann::ordered_json page_json(const std::vector<Found>& all, const PageOptions& options) {
  nlohmann::ordered_json claims = nlohmann::ordered_json::array();
  nlohmann::ordered_json trials = nlohmann::ordered_json::object();
  for (const Found& f : all) {
    trials[f.evidence.name] = {{"done", f.results.count(tables::TrialState::done)},
                               {"all", f.results.trials.size()}};
    for (size_t c = 0; c < f.judgements.size(); ++c) {
      const Claim& claim = f.evidence.asked.claims[c];
      nlohmann::ordered_json findings = nlohmann::ordered_json::array();
      for (const Finding& finding : f.judgements[c].findings) {
        const auto value = [](const std::optional<double>& v) {
          return v ? nlohmann::ordered_json(*v) : nlohmann::ordered_json(nullptr);
        };
        findings.push_back({{"set", finding.set},
                            {"metric", finding.metric},
                            {"difference", value(finding.difference.mean)},
                            {"low", value(finding.difference.low)},
                            {"high", value(finding.difference.high)},
                            {"n", finding.difference.n},
                            {"verdict", kVerdicts[static_cast<int>(finding.verdict)]}});
      }
      claims.push_back({{"experiment", f.evidence.name},
                        {"table", f.evidence.asked.table},
                        {"says", claim.says},
                        {"better", claim.better},
                        {"than", claim.than},
                        {"verdict", verdict_text(f.judgements[c].verdict(), options.budget)},
                        {"so_far", kVerdicts[static_cast<int>(f.judgements[c].so_far)]},
                        {"too_short", f.judgements[c].too_short},
                        {"findings", std::move(findings)}});
    }
  }
  return {{"paper", options.paper},
          {"budget", options.budget},
          {"claims", std::move(claims)},
          {"trials", std::move(trials)}};
}

void write_page(const std::vector<Found>& all, const PageOptions& options,
                const std::string& folder, const std::string& from) {
  const std::string files = files_folder(folder, options);
  const auto seen_from = [&](const std::string& place) {
    std::error_code ignored;
    return fs::relative(from, place, ignored).string();
  };
  for (const Found& f : all) {
    const std::string base = files + "/" + f.evidence.name;
    write_file_atomically(
        base + ".md", table_markdown(f, options, "../" + options.paper + ".md", seen_from(files)));
    if (!f.evidence.runs()) continue;
    const Table table = tables::make_table(f.results, {{}, columns_of(f.evidence.asked), ""});
    for (const char* ending : {".csv", ".tex", ".svg"})
      write_file_atomically(base + ending, tables::to_format(table, f.results, base + ending));
  }
  write_file_atomically(folder + "/" + options.paper + ".md",
                        page_markdown(all, options, options.paper, seen_from(folder)));
}

}  // namespace restage::reproduce
