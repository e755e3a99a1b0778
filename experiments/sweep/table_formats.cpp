#include "experiments/sweep/table_formats.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/words.h"
#include "experiments/sweep/svg.h"
#include "experiments/text.h"

namespace restage::tables {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

/// The shortest text that reads back to the same bits.
std::string exact(const std::optional<double>& value) {
  if (!value) return "";
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, *value).ptr};
}

std::string brief(const Estimate& e) {
  if (!e.mean) return "-";
  std::string text = short_number(*e.mean);
  if (e.deviation) text += " ± " + short_number(*e.deviation);
  if (e.low) text += " [" + short_number(*e.low) + ", " + short_number(*e.high) + "]";
  return text;
}

std::string heading(const metrics::Metric& metric) {
  return std::string(metric.title) + " [" + metric.unit + "]";
}

/// Columns in which some row has a value.
std::vector<size_t> filled(const Table& table, size_t set) {
  std::vector<size_t> out;
  for (size_t c = 0; c < table.columns.size(); ++c)
    if (std::any_of(table.rows.begin(), table.rows.end(),
                    [&](const Row& r) { return r.cells[set][c].value.mean.has_value(); }))
      out.push_back(c);
  return out;
}

/// Trials whose figures count; a metric that some of them lack says so in its cell.
std::string cell_text(const Row& row, const Estimate& e) {
  std::string text = brief(e);
  if (e.mean && !row.reference && e.n != row.n) text += " (n = " + std::to_string(e.n) + ")";
  return text;
}

Rows value_rows(const Table& table, size_t set) {
  Rows rows{{"", "n"}};
  const std::vector<size_t> columns = filled(table, set);
  for (const size_t c : columns) rows[0].push_back(heading(*table.columns[c]));
  for (const Row& row : table.rows) {
    const bool any = std::any_of(columns.begin(), columns.end(), [&](size_t c) {
      return row.cells[set][c].value.mean.has_value();
    });
    if (row.reference && !any) continue;
    int n = row.n;
    for (const size_t c : columns) n = std::max(n, row.reference ? row.cells[set][c].value.n : 0);
    auto& line = rows.emplace_back(Rows::value_type{row.label, std::to_string(n)});
    for (const size_t c : columns) line.push_back(cell_text(row, row.cells[set][c].value));
  }
  return rows;
}

/// Pairs differ from row to row, so each cell says how many it rests on.
Rows difference_rows(const Table& table, size_t set) {
  Rows rows{{""}};
  const std::vector<size_t> columns = filled(table, set);
  for (const size_t c : columns) rows[0].push_back(heading(*table.columns[c]));
  for (const Row& row : table.rows) {
    if (&row == &table.rows[*table.against]) continue;
    auto& line = rows.emplace_back(Rows::value_type{row.label});
    for (const size_t c : columns) {
      const Estimate& e = *row.cells[set][c].difference;
      line.push_back(e.mean && *e.mean > 0 ? "+" + cell_text(row, e) : cell_text(row, e));
    }
  }
  return rows;
}

/// Calls with title and rows of every table that there is to be shown.
void each_table(const Table& table,
                const std::function<void(const std::string&, const Rows&)>& call) {
  for (size_t s = 0; s < table.sets.size(); ++s) {
    call(table.sets[s], value_rows(table, s));
    if (table.against)
      call(table.sets[s] + ", difference to " + table.rows[*table.against].label +
               " (pairs of seed and sequence)",
           difference_rows(table, s));
  }
}

std::string note() {
  return "mean ± sample deviation over n trials [95 % interval, over seeds and "
         "sequences]";
}

/// A file is read without what the command says beside it.
std::string with_notices(const Table& table, std::string text) {
  for (const std::string& notice : table.notices) text += "\n" + on_one_line(notice) + "\n";
  return text;
}

// ---- CSV ---------------------------------------------------------------------------------------

std::string for_csv(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::vector<std::string> override_keys(const Table& table) {
  std::set<std::string> keys;
  for (const Row& row : table.rows)
    for (const auto& [key, value] : row.overrides) keys.insert(key);
  return {keys.begin(), keys.end()};
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (size_t c = 0; c < cells.size(); ++c) line += (c > 0 ? "," : "") + for_csv(cells[c]);
  return line + "\n";
}

void append(std::vector<std::string>* line, const Estimate& e) {
  line->insert(line->end(), {exact(e.mean), exact(e.deviation), std::to_string(e.n), exact(e.low),
                             exact(e.high)});
}

// ---- LaTeX -------------------------------------------------------------------------------------

std::string for_tex(const std::string& text) {
  static const std::vector<std::pair<std::string, std::string>> names = {
      {"±", "$\\pm$"},
      {"²", "\\textsuperscript{2}"},
      {"\\", "\\textbackslash{}"},
      {"~", "\\textasciitilde{}"},
      {"^", "\\textasciicircum{}"}};
  std::string out;
  for (size_t i = 0; i < text.size();) {
    const auto name = std::find_if(names.begin(), names.end(), [&](const auto& item) {
      return text.compare(i, item.first.size(), item.first) == 0;
    });
    if (name != names.end()) {
      out += name->second;
      i += name->first.size();
      continue;
    }
    if (std::string("&%$#_{}").find(text[i]) != std::string::npos) out += '\\';
    out += text[i++];
  }
  return out;
}

/// Brackets after a line's end would be read as a length.
std::string tex_line(const std::vector<std::string>& cells) {
  std::string line;
  for (size_t c = 0; c < cells.size(); ++c)
    line += (c > 0 ? " & " : "{}") + for_tex(on_one_line(cells[c]));
  return line + " \\\\\n";
}

// ---- SVG ---------------------------------------------------------------------------------------

constexpr double kPanel = 220, kTop = 34, kStep = 18;  ///< width, room for titles, height of a row
constexpr size_t kLongestLabel = 70;

void draw_labels(const Table& table, double x, double y, Svg* svg) {
  for (size_t r = 0; r < table.rows.size(); ++r) {
    const std::string& label = table.rows[r].label;
    svg->text(x, y + kStep * (static_cast<double>(r) + 0.5) + 4,
              label.size() <= kLongestLabel ? label : label.substr(0, kLongestLabel - 3) + "...",
              "end");
  }
}

struct Range {
  double low = 1e300, high = -1e300;
  bool empty() const { return low > high; }
  void take(const Estimate& e) {
    low = std::min(low, e.low.value_or(*e.mean));
    high = std::max(high, e.high.value_or(*e.mean));
  }
};

/// What the rows of trials span, and what needs no learning where it is not much farther: a rest
/// pose may be twenty times as far, and on an axis for it all others are one dot.
Range range_of(const Table& table, size_t set, size_t column) {
  Range trials, all;
  const auto each = [&](auto f) {
    for (const Row& row : table.rows)
      if (const Estimate& e = row.cells[set][column].value; e.mean) f(row, e);
  };
  each([&](const Row& row, const Estimate& e) {
    all.take(e);
    if (!row.reference) trials.take(e);
  });
  if (trials.empty()) return all;
  const double far = 2 * (trials.high - trials.low);
  Range out = trials;
  each([&](const Row&, const Estimate& e) {
    if (*e.mean >= trials.low - far && *e.mean <= trials.high + far) out.take(e);
  });
  return out;
}

/// A column with a value: dots and intervals of all rows below each other; beyond the axis the
/// value and an arrow.
void draw_panel(const Table& table, size_t set, size_t column, double x, double y, Svg* svg) {
  const double bottom = y + kStep * static_cast<double>(table.rows.size());
  const Range range = range_of(table, set, column);
  const Axis axis(range.low, range.high, x, x + kPanel);
  svg->text(x, y - 10, table.sets[set] + ": " + heading(*table.columns[column]), "start", 12);
  double written = -1e300;  // how far to the right numbers stand already
  for (const double mark : axis.marks()) {
    const std::string number = short_number(mark);
    const double half = 3.0 * static_cast<double>(number.size());
    svg->line(axis.at(mark), y, axis.at(mark), bottom, "#ddd");
    if (axis.at(mark) - half < written) continue;
    svg->text(axis.at(mark), bottom + 14, number, "middle", 10, "#555");
    written = axis.at(mark) + half + 4;
  }
  for (size_t r = 0; r < table.rows.size(); ++r) {
    const double at = y + kStep * (static_cast<double>(r) + 0.5);
    const Estimate& e = table.rows[r].cells[set][column].value;
    if (!e.mean) continue;
    if (*e.mean < range.low || *e.mean > range.high) {
      const bool below = *e.mean < range.low;
      svg->text(below ? x + 2 : x + kPanel - 2, at + 4,
                below ? "← " + short_number(*e.mean) : short_number(*e.mean) + " →",
                below ? "start" : "end", 10, colour_of(r));
      continue;
    }
    if (e.low) svg->line(axis.at(*e.low), at, axis.at(*e.high), at, colour_of(r), 2);
    svg->dot(axis.at(*e.mean), at, 3.5, colour_of(r));
  }
}

// ---- JSON --------------------------------------------------------------------------------------

Json number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json estimate_json(const Estimate& e) {
  return {{"mean", number(e.mean)},
          {"deviation", number(e.deviation)},
          {"n", e.n},
          {"low", number(e.low)},
          {"high", number(e.high)}};
}

Json row_json(const Table& table, const Row& row) {
  Json overrides = Json::object(), sets = Json::object();
  for (const auto& [key, value] : row.overrides) overrides[key] = value;
  for (size_t s = 0; s < table.sets.size(); ++s) {
    Json& set = sets[table.sets[s]] = Json::object();
    for (size_t c = 0; c < table.columns.size(); ++c) {
      const Cell& cell = row.cells[s][c];
      Json& out = set[table.columns[c]->name] = estimate_json(cell.value);
      if (table.against)
        out["difference"] = cell.difference ? estimate_json(*cell.difference) : Json(nullptr);
    }
  }
  return {{"label", row.label},
          {"case", row.case_name},
          {"overrides", std::move(overrides)},
          {"seeds", row.seeds},
          {"n", row.n},
          {"metrics", std::move(sets)}};
}

}  // namespace

std::string for_markdown(const std::string& text) {
  std::string out;
  for (const char c : on_one_line(text)) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

std::string counts_text(const Results& results) {
  std::vector<std::string> texts;
  for (const TrialState state : {TrialState::done, TrialState::failed, TrialState::stopped,
                                 TrialState::pending, TrialState::damaged})
    if (const int count = results.count(state); count > 0 || state == TrialState::done)
      texts.push_back(cat(count, " ", kTrialStates[static_cast<int>(state)]));
  return joined(texts);
}

std::string to_markdown(const Table& table, const Results& results) {
  std::string text = "Trials: " + counts_text(results) + ". Figures are of those that are done.\n";
  each_table(table, [&](const std::string& title, Rows rows) {
    for (auto& row : rows)
      for (std::string& cell : row) cell = for_markdown(cell);
    text += "\n**" + on_one_line(title) + "**\n\n" + markdown_table(rows);
  });
  if (!table.sets.empty()) text += "\n" + note() + "\n";
  return text;
}

std::string to_csv(const Table& table) {
  const std::vector<std::string> keys = override_keys(table);
  std::vector<std::string> head = {"label", "case"};
  head.insert(head.end(), keys.begin(), keys.end());
  head.insert(head.end(), {"set", "metric", "unit", "mean", "deviation", "n", "low", "high"});
  if (table.against)
    head.insert(head.end(), {"against", "difference", "difference_deviation", "difference_n",
                             "difference_low", "difference_high"});
  std::string text = csv_line(head);
  for (const Row& row : table.rows)
    for (size_t s = 0; s < table.sets.size(); ++s)
      for (size_t c = 0; c < table.columns.size(); ++c) {
        const Cell& cell = row.cells[s][c];
        std::vector<std::string> line = {row.label, row.case_name};
        for (const std::string& key : keys)
          line.push_back(row.overrides.contains(key) ? plain_text(row.overrides.at(key)) : "");
        line.insert(line.end(), {table.sets[s], table.columns[c]->name, table.columns[c]->unit});
        append(&line, cell.value);
        if (table.against) {
          line.push_back(table.rows[*table.against].label);
          append(&line, cell.difference.value_or(Estimate{}));
        }
        text += csv_line(line);
      }
  return text;
}

std::string to_tex(const Table& table, const Results& results) {
  std::string text = "% needs \\usepackage{booktabs}; trials: " + counts_text(results) + "\n";
  each_table(table, [&](const std::string& title, const Rows& rows) {
    text += "% " + on_one_line(title) + "\n\\begin{tabular}{l" +
            std::string(rows[0].size() - 1, 'r') + "}\n\\toprule\n" + tex_line(rows[0]) +
            "\\midrule\n";
    for (size_t r = 1; r < rows.size(); ++r) text += tex_line(rows[r]);
    text += "\\bottomrule\n\\end{tabular}\n\n";
  });
  return text + "% " + note() + "\n";
}

std::string to_svg(const Table& table) {
  size_t longest = 4;
  for (const Row& row : table.rows) longest = std::max(longest, row.label.size());
  const double left = 20 + 6.2 * static_cast<double>(std::min(longest, kLongestLabel));
  Svg svg;
  double width = left + kPanel, y = kTop;
  for (size_t s = 0; s < table.sets.size(); ++s) {
    const std::vector<size_t> columns = filled(table, s);
    if (columns.empty()) continue;
    draw_labels(table, left - 10, y, &svg);
    double x = left;
    for (const size_t c : columns) {
      draw_panel(table, s, c, x, y, &svg);
      width = std::max(width, x + kPanel);
      x += kPanel + 30;
    }
    y += kStep * static_cast<double>(table.rows.size()) + kTop + 40;
  }
  svg.text(12, y - 18, "mean, and 95 % interval over seeds and sequences", "start", 10, "#555");
  return svg.document(width + 20, y - 8);
}

Json to_json(const Table& table, const Results& results) {
  Json rows = Json::array(), references = Json::array(), counts = Json::object();
  const size_t trials = table.rows.size() - table.references;
  for (size_t r = 0; r < table.rows.size(); ++r)
    (r < trials ? rows : references).push_back(row_json(table, table.rows[r]));
  for (const TrialState state : {TrialState::done, TrialState::failed, TrialState::stopped,
                                 TrialState::pending, TrialState::damaged})
    counts[kTrialStates[static_cast<int>(state)]] = results.count(state);
  std::vector<std::string> notices = results.notices;
  notices.insert(notices.end(), table.notices.begin(), table.notices.end());
  return {{"rows", std::move(rows)},
          {"references", std::move(references)},
          {"against", table.against ? Json(table.rows[*table.against].label) : Json(nullptr)},
          {"trials", std::move(counts)},
          {"notices", notices}};
}

std::string to_format(const Table& table, const Results& results, const std::string& path) {
  const std::string ending = path.substr(std::min(path.size(), path.find_last_of('.')));
  if (ending == ".md") return with_notices(table, to_markdown(table, results));
  if (ending == ".csv") return to_csv(table);
  if (ending == ".tex") return to_tex(table, results);
  if (ending == ".svg") return to_svg(table);
  throw InputError(path, "is no table that can be written",
                   "give a name that ends in .md, .csv, .tex or .svg");
}

}  // namespace restage::tables
