#include "experiments/cli/data/import_text.h"

#include <algorithm>

namespace restage::cli {
namespace {

Json as_json(const ImportReport& report) {
  Json facts = Json::object();
  for (const auto& [name, value] : report.facts) facts[name] = value;
  return {{"file", report.file}, {"facts", facts}, {"remarks", report.remarks}};
}

std::string remarks_of(const ImportReport& report) {
  std::string text;
  for (const std::string& remark : report.remarks) text += "  note: " + remark + "\n";
  return text;
}

/// All of a report: one fact a line.
std::string block(const ImportReport& report) {
  constexpr size_t kColumn = 14;
  std::string text = report.file + "\n";
  for (const auto& [name, value] : report.facts)
    text += "  " + name + std::string(name.size() < kColumn ? kColumn - name.size() : 1, ' ') +
            value + "\n";
  return text + remarks_of(report);
}

/// The first words of what matters most, in one line; remarks in lines of their own.
std::string summary(const ImportReport& report) {
  static const std::vector<std::string> shown = {"layout", "names",  "units",     "scale",
                                                 "up",     "rate",   "rest pose", "body model",
                                                 "clips",  "points", "beginning"};
  std::string text = report.file + ":";
  for (const auto& [name, value] : report.facts) {
    if (std::find(shown.begin(), shown.end(), name) == shown.end()) continue;
    std::string words = value.substr(0, value.find_first_of(",:;("));
    words.erase(words.find_last_not_of(' ') + 1);
    text += (text.back() == ':' ? " " : "; ") + words + (name == "up" ? " up" : "");
  }
  return text + "\n" + remarks_of(report);
}

}  // namespace

Json reports_json(const std::vector<ImportReport>& reports) {
  Json out = Json::array();
  for (const ImportReport& report : reports) out.push_back(as_json(report));
  return out;
}

std::string reports_text(const std::vector<ImportReport>& reports, bool verbose) {
  constexpr size_t kMost = 40;  // a screenful; --verbose and --json have all
  const size_t count = verbose ? reports.size() : std::min(kMost, reports.size());
  std::string out;
  for (size_t i = 0; i < count; ++i)
    out += verbose || reports.size() == 1 ? block(reports[i]) : summary(reports[i]);
  if (count < reports.size())
    out += "and " + std::to_string(reports.size() - count) + " more (--verbose lists all)\n";
  return out;
}

}  // namespace restage::cli
