#include "experiments/reproduce/page_text.h"

#include <algorithm>
#include <map>

#include "autograd/base/words.h"
#include "experiments/sweep/svg.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/text.h"

namespace restage::reproduce {
namespace {

using tables::Estimate;

std::string signed_number(double value) {
  return (value > 0 ? "+" : "") + tables::short_number(value);
}

/// What is claimed of two rows where it is not an order.
std::string margin_text(const Claim& claim) {
  if (claim.within)
    return ", which are to differ by less than " + tables::short_number(*claim.within);
  if (claim.no_better_by)
    return ", than which it is to be no better by " + tables::short_number(*claim.no_better_by);
  return "";
}

/// What the paper prints of a claim's first metric, on its first set.
std::string printed_text(const PaperFile& file, const Claim& claim) {
  const std::string& metric = claim.metrics.empty() ? file.metrics[0] : claim.metrics[0];
  const auto at = std::find(file.metrics.begin(), file.metrics.end(), metric);
  for (const PaperTable& table : file.tables) {
    std::vector<std::string> values;
    for (const std::string& label : {claim.better, claim.than})
      for (const PaperRow& row : table.rows) {
        const auto column = static_cast<size_t>(at - file.metrics.begin());
        if (row.row == label && column < row.printed.size() && row.printed[column])
          values.push_back(tables::short_number(*row.printed[column]));
      }
    if (values.size() == 2) return metric + " " + values[0] + " against " + values[1];
  }
  return "-";
}

std::string so_far_text(Verdict verdict) { return kVerdicts[static_cast<int>(verdict)]; }

/// Whether a claim that cannot be told would have been, without the others of its page.
bool alone_clear(const Judgement& judgement, bool most) {
  return judgement.so_far == Verdict::cannot_be_told &&
         judgement_of(judgement.findings, most).so_far != Verdict::cannot_be_told;
}

/// What stands behind a verdict.
std::string why_text(const Judgement& judgement, bool most) {
  if (judgement.so_far == Verdict::not_run) return "a row is not run";
  const auto count = [&](Verdict verdict) {
    return std::count_if(judgement.findings.begin(), judgement.findings.end(),
                         [&](const Finding& f) { return f.verdict == verdict; });
  };
  std::string text =
      cat(count(Verdict::holds), " of ", judgement.findings.size(), " comparisons hold");
  if (const auto reversed = count(Verdict::does_not_hold); reversed > 0)
    text += cat(", reversed ", reversed);
  if (alone_clear(judgement, most)) text += ", not clear beside the other claims";
  if (judgement.too_short.empty()) return text;
  return judgement.too_short[0] + "; so far it " +
         (judgement.so_far == Verdict::cannot_be_told ? "cannot be told"
                                                      : so_far_text(judgement.so_far)) +
         ": " + text;
}

}  // namespace

std::string number(const std::optional<double>& value) {
  return value ? tables::short_number(*value) : "-";
}

std::string with_interval(const Estimate& e, bool sign) {
  if (!e.mean) return "-";
  std::string text = sign ? signed_number(*e.mean) : tables::short_number(*e.mean);
  if (e.deviation) text += " ± " + tables::short_number(*e.deviation);
  if (e.low)
    text += " [" + tables::short_number(*e.low) + ", " + tables::short_number(*e.high) + "]";
  return text;
}

std::string table_text(Rows rows) {
  for (auto& row : rows)
    for (std::string& cell : row) cell = tables::for_markdown(cell);
  return markdown_table(rows);
}

std::string linked(const std::string& text, const std::string& to) {
  return "[" + on_one_line(text) + "](" + to + ")";
}

std::string link_to_table(const Found& f, const std::string& tables) {
  return linked(f.evidence.asked.table, tables + "/" + f.evidence.name + ".md");
}

std::string claim_text(const Claim& claim, const Judgement& judgement, const std::string& budget) {
  std::string text = "> " + on_one_line(claim.says) + " (" + claim.where + ")\n\n**" +
                     verdict_text(judgement.verdict(), budget) + "**: " + claim.better +
                     " against " + claim.than + margin_text(claim) +
                     (claim.most ? ", three quarters of the comparisons needed" : "") + ".\n";
  if (judgement.so_far != Verdict::not_run) {
    Rows rows{{"set, metric", "pairs of seeds", claim.better + " - " + claim.than, ""}};
    for (const Finding& f : judgement.findings)
      rows.push_back({f.set + ", " + f.metric, std::to_string(f.difference.n),
                      with_interval(f.difference, true), kVerdicts[static_cast<int>(f.verdict)]});
    text += "\n" + table_text(rows);
    for (const std::string& why : judgement.too_short) text += "\n" + why + ".\n";
    if (!judgement.too_short.empty())
      text += "\nAs far as it was trained: " + so_far_text(judgement.so_far) + ".\n";
    if (alone_clear(judgement, claim.most))
      text += "\nClear by itself, and not beside the other claims of the page (Holm).\n";
  }
  if (!claim.tried.empty()) text += "\nTried: " + claim.tried + "\n";
  return text + "\n";
}

/// Every claim with its verdict. A sentence that is claimed of several pairs of rows stands once;
/// one with several readings has a line of its own at their end.
std::string claims_text(const std::vector<Found>& all, const std::string& tables,
                        const std::string& budget) {
  Rows rows{{"claim", "compared", "paper", "here", "why", "table"}};
  std::map<Verdict, int> counts;
  for (const Found& f : all) {
    const std::vector<Claim>& claims = f.evidence.asked.claims;
    std::vector<Verdict> verdicts;
    for (const Judgement& judgement : f.judgements) verdicts.push_back(judgement.verdict());
    for (const Sentence& sentence : sentences_of(claims, verdicts)) {
      const bool several = sentence.readings.size() > 1;
      bool first = true;
      for (size_t c = 0; c < claims.size(); ++c) {
        if (claims[c].says != sentence.says) continue;
        std::string compared = claims[c].better + " against " + claims[c].than;
        if (several) compared += ", read as " + claims[c].reading;
        rows.push_back({first ? sentence.says : "", compared,
                        printed_text(f.evidence.asked, claims[c]),
                        verdict_text(verdicts[c], budget),
                        why_text(f.judgements[c], claims[c].most), link_to_table(f, tables)});
        first = false;
        if (!several) ++counts[verdicts[c]];
      }
      if (!several) continue;
      const Verdict verdict = sentence_verdict(sentence);
      ++counts[verdict];
      rows.push_back({"", "in all its readings", "", verdict_text(verdict, budget),
                      "its readings must agree", ""});
    }
  }
  const std::string text = joined(counts, [&](const auto& one) {
    return cat(one.second, " ", verdict_text(one.first, budget));
  });
  return "Claims: " + (text.empty() ? "none" : text) + ".\n\n" + table_text(rows) + "\n";
}

}  // namespace restage::reproduce
