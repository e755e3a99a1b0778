#include "experiments/reproduce/verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "experiments/reproduce/converged.h"
#include "experiments/sweep/table.h"

namespace restage::reproduce {
namespace {

constexpr double kLevel = 0.05;

/// Of a table, by label; nothing if there is no such row or set.
template <class List, class Name>
std::optional<size_t> index_of(const List& list, const Name& name) {
  for (size_t i = 0; i < list.size(); ++i)
    if (name(list[i])) return i;
  return std::nullopt;
}

std::optional<size_t> place_of(const tables::Table& table, const std::string& label) {
  return index_of(table.rows, [&](const tables::Row& row) { return row.label == label; });
}

const PaperRow* row_of(const PaperTable& table, const std::string& label) {
  const auto at = index_of(table.rows, [&](const PaperRow& row) { return row.row == label; });
  return at ? &table.rows[*at] : nullptr;
}

bool has_both(const PaperTable& table, const Claim& claim) {
  return row_of(table, claim.better) != nullptr && row_of(table, claim.than) != nullptr;
}

/// The claim is that the difference lies between these two.
std::pair<double, double> claimed_range(const Claim& claim) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  if (claim.within) return {-*claim.within, *claim.within};
  if (claim.no_better_by) return {-*claim.no_better_by, kFar};
  return {-kFar, 0};
}

/// The level at which `needed` of the comparisons are on one side.
double level_of(const std::vector<Finding>& findings, size_t needed, double Finding::*p) {
  std::vector<double> levels;
  for (const Finding& f : findings) levels.push_back(f.*p);
  std::sort(levels.begin(), levels.end());
  return std::min(1.0, static_cast<double>(levels.size() - needed + 1) * levels[needed - 1]);
}

std::optional<double> printed_value(const PaperRow& row, const std::optional<size_t>& column) {
  return column && *column < row.printed.size() ? row.printed[*column] : std::nullopt;
}

/// Of two pairs of rows that one sentence is about.
Verdict both(Verdict a, Verdict b) {
  for (const Verdict one :
       {Verdict::not_run, Verdict::not_trained, Verdict::does_not_hold, Verdict::cannot_be_told})
    if (a == one || b == one) return one;
  return Verdict::holds;
}

/// A little less than a unit of the last digit that a column shows: figures with other digits were
/// different before they were rounded, and equal ones may have been.
double rounding(const PaperTable& table, size_t column) {
  constexpr int kMostDigits = 6;
  double unit = 1;
  for (const PaperRow& row : table.rows) {
    if (column >= row.printed.size() || !row.printed[column]) continue;
    const double value = *row.printed[column];
    for (int digits = 0; digits <= kMostDigits; ++digits) {
      const double one = std::pow(10, -digits);
      if (std::abs(value - one * std::round(value / one)) < 1e-9 * std::max(1.0, value)) {
        unit = std::min(unit, one);
        break;
      }
    }
  }
  return 0.999 * unit;
}

}  // namespace

const std::string& measured_set(const Budget& budget, const PaperTable& table) {
  return budget.set.empty() ? table.set : budget.set;
}

std::string verdict_text(Verdict verdict, const std::string& budget) {
  const std::string text = kVerdicts[static_cast<int>(verdict)];
  return verdict <= Verdict::cannot_be_told ? text + " at " + budget : text;
}

Finding finding_of(const tables::Estimate& difference, const Claim& claim) {
  Finding out{"", "", difference};
  if (difference.n == 0) return out;
  out.verdict = Verdict::cannot_be_told;
  if (difference.n < kFewestSeeds || difference.parts.empty()) return out;
  const auto [from, to] = claimed_range(claim);
  const double mean = *difference.mean;
  const double beyond_from = std::isfinite(from) ? difference.p_beyond(from) : 0;
  const double beyond_to = std::isfinite(to) ? difference.p_beyond(to) : 0;
  if (mean > from && mean < to) out.p_holds = std::max(beyond_from, beyond_to);
  if (mean < from) out.p_fails = beyond_from;
  if (mean > to) out.p_fails = beyond_to;
  if (out.p_holds <= kLevel) out.verdict = Verdict::holds;
  if (out.p_fails <= kLevel) out.verdict = Verdict::does_not_hold;
  return out;
}

Judgement judgement_of(std::vector<Finding> findings, bool most) {
  Judgement out{Verdict::not_run, std::move(findings)};
  const auto& all = out.findings;
  if (all.empty() || std::any_of(all.begin(), all.end(),
                                 [](const Finding& f) { return f.verdict == Verdict::not_run; }))
    return out;
  const size_t needed = most ? (3 * all.size() + 3) / 4 : all.size();
  const double holds = level_of(all, needed, &Finding::p_holds);
  const double fails = level_of(all, all.size() - needed + 1, &Finding::p_fails);
  out.p = std::min(holds, fails);
  out.so_far = out.p > kLevel   ? Verdict::cannot_be_told
               : holds <= fails ? Verdict::holds
                                : Verdict::does_not_hold;
  return out;
}

void judge_together(const std::vector<Judgement*>& claims) {
  std::vector<Judgement*> run;
  for (Judgement* claim : claims)
    if (claim->so_far != Verdict::not_run) run.push_back(claim);
  std::stable_sort(run.begin(), run.end(),
                   [](const Judgement* a, const Judgement* b) { return a->p < b->p; });
  bool clear = true;
  for (size_t i = 0; i < run.size(); ++i) {
    clear = clear && run[i]->p <= kLevel / static_cast<double>(run.size() - i);
    if (!clear) run[i]->so_far = Verdict::cannot_be_told;
  }
}

Judgement judge(const PaperFile& file, const Budget& budget, const Claim& claim,
                const tables::Results& results) {
  const std::vector<std::string>& metrics = claim.metrics.empty() ? file.metrics : claim.metrics;
  tables::TableOptions options{{}, metrics};
  tables::Table table = tables::make_table(results, options);
  const auto better = place_of(table, claim.better), than = place_of(table, claim.than);
  if (better && than) {
    options.against = claim.than;
    table = tables::make_table(results, options);
  }
  std::vector<Finding> findings;
  for (const PaperTable& printed : file.tables) {
    if (!has_both(printed, claim)) continue;
    const std::string& name = measured_set(budget, printed);
    const auto set = index_of(table.sets, [&](const std::string& s) { return s == name; });
    for (size_t c = 0; c < metrics.size(); ++c) {
      const bool run = better && than && set;
      findings.push_back(finding_of(
          run ? *table.rows[*better].cells[*set][c].difference : tables::Estimate{}, claim));
      findings.back().set = name;
      findings.back().metric = metrics[c];
    }
    if (!budget.set.empty()) break;  // one set stands for all
  }
  Judgement out = judgement_of(std::move(findings), claim.most);
  if (out.so_far == Verdict::not_run) return out;
  for (const auto& row : {better, than})
    if (const std::string why = too_short(results, table.rows[*row].case_name, metrics);
        !why.empty())
      out.too_short.push_back(table.rows[*row].label + ": " + why);
  return out;
}

Verdict printed_verdict(const PaperFile& file, const Claim& claim) {
  const std::vector<std::string>& metrics = claim.metrics.empty() ? file.metrics : claim.metrics;
  const auto [from, to] = claimed_range(claim);
  std::vector<Finding> told;
  bool any = false;
  for (const PaperTable& table : file.tables) {
    const PaperRow *better = row_of(table, claim.better), *than = row_of(table, claim.than);
    if (better == nullptr || than == nullptr) continue;
    for (const std::string& metric : metrics) {
      const auto column = index_of(file.metrics, [&](const std::string& m) { return m == metric; });
      const auto a = printed_value(*better, column), b = printed_value(*than, column);
      if (!a || !b) continue;
      any = true;
      const double reach = rounding(table, *column), d = *a - *b;
      Finding one{table.set, metric, {}, 1, 1, Verdict::cannot_be_told};
      if (d - reach > from && d + reach < to) one.p_holds = 0, one.verdict = Verdict::holds;
      if (d + reach < from || d - reach > to) one.p_fails = 0, one.verdict = Verdict::does_not_hold;
      if (one.verdict != Verdict::cannot_be_told) told.push_back(one);
    }
  }
  if (told.empty()) return any ? Verdict::cannot_be_told : Verdict::not_run;
  return judgement_of(std::move(told), claim.most).so_far;
}

std::vector<Sentence> sentences_of(const std::vector<Claim>& claims,
                                   const std::vector<Verdict>& verdicts) {
  std::vector<Sentence> out;
  for (size_t c = 0; c < claims.size(); ++c) {
    auto same = std::find_if(out.begin(), out.end(),
                             [&](const Sentence& s) { return s.says == claims[c].says; });
    if (same == out.end()) same = out.insert(out.end(), {claims[c].says});
    const auto [reading, fresh] = same->readings.try_emplace(claims[c].reading, verdicts[c]);
    if (!fresh) reading->second = both(reading->second, verdicts[c]);
  }
  return out;
}

Verdict sentence_verdict(const Sentence& sentence) {
  const Verdict first = sentence.readings.begin()->second;
  const bool agree = std::all_of(sentence.readings.begin(), sentence.readings.end(),
                                 [&](const auto& one) { return one.second == first; });
  return agree ? first : Verdict::cannot_be_told;
}

Verdict best_reading(const Sentence& sentence) {
  Verdict out = Verdict::not_run;
  for (const auto& [reading, verdict] : sentence.readings)
    if (verdict == Verdict::holds || out == Verdict::not_run) out = verdict;
  return out;
}

}  // namespace restage::reproduce
