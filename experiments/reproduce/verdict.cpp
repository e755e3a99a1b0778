#include "experiments/reproduce/verdict.h"

#include <algorithm>
#include <limits>

#include "experiments/sweep/table.h"

namespace restage::reproduce {
namespace {

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

bool has_both(const PaperTable& table, const Claim& claim) {
  int found = 0;
  for (const PaperRow& row : table.rows) found += row.row == claim.better || row.row == claim.than;
  return found == 2;
}

}  // namespace

const std::string& measured_set(const Budget& budget, const PaperTable& table) {
  return budget.set.empty() ? table.set : budget.set;
}

Verdict verdict_of(const tables::Estimate& difference, const Claim& claim) {
  if (difference.n == 0) return Verdict::not_run;
  if (difference.n < kFewestSeeds || !difference.low) return Verdict::cannot_be_told;
  // The claim is that the difference lies between these two.
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double from = -kFar, to = 0;
  if (claim.within) from = -*claim.within, to = *claim.within;
  if (claim.no_better_by) from = -*claim.no_better_by, to = kFar;
  const double low = *difference.low, high = *difference.high;
  if (low > from && high < to) return Verdict::holds;
  return high < from || low > to ? Verdict::does_not_hold : Verdict::cannot_be_told;
}

Verdict verdict_of(const std::vector<Finding>& findings, bool most) {
  const auto count = [&](Verdict verdict) {
    return std::count_if(findings.begin(), findings.end(),
                         [&](const Finding& f) { return f.verdict == verdict; });
  };
  const auto all = static_cast<std::ptrdiff_t>(findings.size());
  if (all == 0 || count(Verdict::not_run) > 0) return Verdict::not_run;
  const std::ptrdiff_t needed = most ? (3 * all + 3) / 4 : all;
  if (count(Verdict::holds) >= needed) return Verdict::holds;
  return count(Verdict::does_not_hold) > all - needed ? Verdict::does_not_hold
                                                      : Verdict::cannot_be_told;
}

Judgement judge(const PaperFile& file, const Budget& budget, const Claim& claim,
                const tables::Results& results, uint64_t seed) {
  const std::vector<std::string>& metrics = claim.metrics.empty() ? file.metrics : claim.metrics;
  tables::TableOptions options{{}, metrics, "", seed};
  tables::Table table = tables::make_table(results, options);
  const auto better = place_of(table, claim.better), than = place_of(table, claim.than);
  if (better && than) {
    options.against = claim.than;
    table = tables::make_table(results, options);
  }
  Judgement out;
  for (const PaperTable& printed : file.tables) {
    if (!has_both(printed, claim)) continue;
    const std::string& name = measured_set(budget, printed);
    const auto set = index_of(table.sets, [&](const std::string& s) { return s == name; });
    for (size_t c = 0; c < metrics.size(); ++c) {
      Finding finding{name, metrics[c], {}};
      if (better && than && set)
        finding.difference = *table.rows[*better].cells[*set][c].difference;
      finding.verdict = verdict_of(finding.difference, claim);
      out.findings.push_back(std::move(finding));
    }
    if (!budget.set.empty()) break;  // one set stands for all
  }
  out.verdict = verdict_of(out.findings, claim.most);
  return out;
}

}  // namespace restage::reproduce
