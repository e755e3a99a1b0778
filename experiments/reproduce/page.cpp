#include "experiments/reproduce/page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>

#include "autograd/base/atomic_file.h"
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
using Rows = std::vector<std::vector<std::string>>;

constexpr size_t kWorst = 5;

std::string number(const std::optional<double>& value) {
  return value ? tables::short_number(*value) : "-";
}

std::string signed_number(double value) {
  return (value > 0 ? "+" : "") + tables::short_number(value);
}

std::string with_interval(const Estimate& e, bool sign = false) {
  if (!e.mean) return "-";
  std::string text = sign ? signed_number(*e.mean) : tables::short_number(*e.mean);
  if (e.deviation) text += " ± " + tables::short_number(*e.deviation);
  if (e.low)
    text += " [" + tables::short_number(*e.low) + ", " + tables::short_number(*e.high) + "]";
  return text;
}

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

std::string table_text(Rows rows) {
  for (auto& row : rows)
    for (std::string& cell : row) cell = tables::for_markdown(cell);
  return markdown_table(rows);
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
  std::vector<std::string> words = {"restage", "sweep", "run", f.evidence.sweep_file()};
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

// ---- claims ------------------------------------------------------------------------------------

/// What is claimed of two rows where it is not an order.
std::string margin_text(const Claim& claim) {
  if (claim.within)
    return ", which are to differ by less than " + tables::short_number(*claim.within);
  if (claim.no_better_by)
    return ", than which it is to be no better by " + tables::short_number(*claim.no_better_by);
  return "";
}

std::string claim_text(const Claim& claim, const Judgement& judgement) {
  std::string text = "> " + on_one_line(claim.says) + " (" + claim.where + ")\n\n**" +
                     kVerdicts[static_cast<int>(judgement.verdict)] + "**: " + claim.better +
                     " against " + claim.than + margin_text(claim) +
                     (claim.most ? ", three quarters of the comparisons needed" : "") + ".\n";
  if (judgement.verdict != Verdict::not_run) {
    Rows rows{{"set, metric", "pairs of seeds", claim.better + " - " + claim.than, ""}};
    for (const Finding& f : judgement.findings)
      rows.push_back({f.set + ", " + f.metric, std::to_string(f.difference.n),
                      with_interval(f.difference, true), kVerdicts[static_cast<int>(f.verdict)]});
    text += "\n" + table_text(rows);
  }
  if (!claim.tried.empty()) text += "\nTried: " + claim.tried + "\n";
  return text + "\n";
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
  std::string text = "Worst sequences of " + label + ": ";
  for (size_t i = 0; i < std::min(kWorst, all.size()); ++i)
    text += (i > 0 ? ", " : "") + all[i].second + " " + in_mm(all[i].first);
  return text + "; the best: " + all.back().second + " " + in_mm(all.back().first) + ".\n\n";
}

/// Where the errors are: by motion, bodies and joint, the worst sequences. Folded, since it is
/// long.
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
  return "<details><summary>Where the errors are: PA-MPJPE in mm by motion, bodies and joint, the "
         "worst sequences</summary>\n\n" +
         split_table("motion", labels, motions) + split_table("bodies", labels, bodies) +
         split_table("joint", labels, joints) + worst + "</details>\n\n";
}

/// What the trials took: together, and one of each row.
std::string effort_text(const Results& results, const Table& table) {
  double seconds = 0;
  Averages by_case;
  for (const tables::TrialResult& trial : results.trials) {
    seconds += trial.seconds;
    if (trial.state == tables::TrialState::done) by_case.add(trial.case_name, trial.seconds);
  }
  const auto means = by_case.means();
  std::string rows;
  for (const tables::Row& row : table.rows) {
    const auto mean = means.find(row.case_name);
    if (row.reference || row.case_name.empty() || mean == means.end()) continue;
    rows += (rows.empty() ? " A trial of " : ", of ") + row.label + " took " +
            duration_text(mean->second);
  }
  return "Trials: " + tables::counts_text(results) + "; " + duration_text(seconds) +
         " of work in their last attempts, beside whatever else the machine did." + rows +
         (rows.empty() ? "\n\n" : ".\n\n");
}

std::vector<std::string> columns_of(const PaperFile& asked) {
  std::vector<std::string> out = asked.metrics;
  for (const std::string& metric : asked.beside)
    if (std::find(out.begin(), out.end(), metric) == out.end()) out.push_back(metric);
  return out;
}

std::string section(const Found& f, const PageOptions& options, const std::string& files,
                    const std::string& home) {
  const PaperFile& asked = f.evidence.asked;
  const Budget& budget = asked.budget(options.budget);
  std::string text = "## " + asked.table + ": " + asked.title + "\n\n[" + f.evidence.name + "](" +
                     home + "/" + f.evidence.name +
                     "/README.md) says what is the same here and what is not.";
  if (!budget.note.empty()) text += " " + budget.note;
  text += "\n\n";
  const Table table = tables::make_table(f.results, {{}, columns_of(asked), "", options.seed});
  for (const PaperTable& printed : asked.tables) {
    const std::string& set = measured_set(budget, printed);
    text += "**" + printed.set + (set == printed.set ? "" : ", measured on " + set) + "**\n\n" +
            table_text(beside_each_other(printed, f.results, table, set)) + reasons(printed) + "\n";
    text += where_text(f.results, printed, set, table);
    if (!budget.set.empty()) break;
  }
  for (size_t c = 0; c < asked.claims.size(); ++c)
    text += claim_text(asked.claims[c], f.judgements[c]);
  for (const Drawn& picture : f.pictures)
    text += "![" + on_one_line(picture.says) + "](" + files + "/" + picture.file + ")\n\n" +
            on_one_line(picture.says) + "\n\n";
  if (!f.evidence.runs()) return text;
  const std::string base = files + "/" + f.evidence.name;
  return text + effort_text(f.results, table) + "Alone: `" + sweep_command(f, budget) +
         "`. [CSV](" + base + ".csv), [LaTeX](" + base + ".tex), [SVG](" + base + ".svg).\n\n";
}

std::string summary(const std::vector<Found>& all) {
  Rows rows{{"claim", "table", "compared", "verdict"}};
  std::map<Verdict, int> counts;
  for (const Found& f : all)
    for (size_t c = 0; c < f.judgements.size(); ++c) {
      const Verdict verdict = f.judgements[c].verdict;
      ++counts[verdict];
      const Claim& claim = f.evidence.asked.claims[c];
      rows.push_back({claim.says, f.evidence.asked.table, claim.better + " against " + claim.than,
                      kVerdicts[static_cast<int>(verdict)]});
    }
  std::string text;
  for (const auto& [verdict, n] : counts)
    text +=
        (text.empty() ? "" : ", ") + std::to_string(n) + " " + kVerdicts[static_cast<int>(verdict)];
  return "Claims: " + (text.empty() ? "none" : text) + ".\n\n" + table_text(rows) + "\n";
}

const char* const kRule =
    "A claim is judged by paired differences over seeds and sequences: it **holds** if the 95 % "
    "interval of every\ncomparison lies on its side, **does not hold** if one lies on the other, "
    "and **cannot be told** otherwise or with fewer\nthan three seeds. The rule was written before "
    "the runs, but for one amendment that it names (`experiments/reproduce/verdict.h`).\nOrders "
    "are "
    "judged, never figures: other data and other budgets than the paper's. Ours: mean ± sample "
    "deviation over n seeds\n[95 % interval: bootstrap over sequences and seeds]; with three seeds "
    "such an interval holds the truth in some 75 of 100 cases\n(docs/metrics.md).\n\n";

/// Of what is beside the page; made if it is not there.
std::string files_folder(const std::string& folder, const PageOptions& options) {
  const std::string files = folder + "/" + options.paper;
  make_folder(files);
  return files;
}

}  // namespace

Found found(const Evidence& evidence, const PageOptions& options, const std::string& folder) {
  Found out{evidence, results_of(evidence)};
  const Budget& budget = evidence.asked.budget(options.budget);
  for (const Claim& claim : evidence.asked.claims)
    out.judgements.push_back(judge(evidence.asked, budget, claim, out.results, options.seed));
  out.pictures = draw_pictures(evidence, out.results, files_folder(folder, options));
  return out;
}

std::string page_markdown(const std::vector<Found>& all, const PageOptions& options,
                          const std::string& tables, const std::string& home) {
  std::string text = "# " + options.paper + ", run again\n\nBudget: " + options.budget +
                     ". Made by\n\n```\n" + typed(options.command) + "\n```\n\n" + kRule +
                     summary(all);
  for (const Found& f : all) text += section(f, options, tables, home);
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
                        {"verdict", kVerdicts[static_cast<int>(f.judgements[c].verdict)]},
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
  for (const Found& f : all) {
    if (!f.evidence.runs()) continue;
    const Table table =
        tables::make_table(f.results, {{}, columns_of(f.evidence.asked), "", options.seed});
    for (const char* ending : {".csv", ".tex", ".svg"}) {
      const std::string path = files + "/" + f.evidence.name + ending;
      write_file_atomically(path, tables::to_format(table, f.results, path));
    }
  }
  std::error_code code;
  const std::string home = fs::relative(from, folder, code).string();
  write_file_atomically(folder + "/" + options.paper + ".md",
                        page_markdown(all, options, options.paper, home));
}

}  // namespace restage::reproduce
