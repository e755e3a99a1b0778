#include "experiments/report/page.h"

#include <algorithm>
#include <sstream>

#include "experiments/sweep/svg.h"
#include "infer/render/html.h"

namespace restage::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kPage =
#include "experiments/report/page.html.inc"
    ;
constexpr const char* kStyle =
#include "experiments/report/style.css.inc"
    ;
constexpr const char* kScript =
#include "experiments/report/report.js.inc"
    ;
constexpr size_t kMostPoints = 1000;

/// The cells of a line of a Markdown table; "\|" is a bar inside of one.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> out{""};
  for (size_t i = 1; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size() && line[i + 1] == '|')
      out.back() += line[++i];
    else if (line[i] == '|')
      out.emplace_back();
    else
      out.back() += line[i];
  }
  out.pop_back();  // behind the last bar
  for (std::string& cell : out) {
    cell.erase(0, std::min(cell.find_first_not_of(' '), cell.size()));
    cell.erase(cell.find_last_not_of(' ') + 1);
  }
  return out;
}

std::string row_html(const std::string& line, const char* cell) {
  std::string out = "<tr>";
  for (const std::string& text : cells_of(line))
    out += std::string("<") + cell + ">" + escape_html(text) + "</" + cell + ">";
  return out + "</tr>\n";
}

std::string html_of(const std::string& markdown) {
  std::istringstream lines(markdown);
  std::string out;
  bool in_table = false, in_text = false;
  for (std::string line; std::getline(lines, line);) {
    const bool row = line.starts_with("|");
    if (in_table && !row) out += "</tbody></table></div>\n";
    if (in_text && (row || line.empty())) out += "</p>\n";
    if (row && !in_table) {
      out += "<div class=\"table\"><table><thead>" + row_html(line, "th") + "</thead><tbody>\n";
      std::getline(lines, line);  // the rule under the heading
    } else if (row) {
      out += row_html(line, "td");
    } else if (line.starts_with("**") && line.ends_with("**") && line.size() > 4) {
      out += "<h3>" + escape_html(line.substr(2, line.size() - 4)) + "</h3>\n";
      line.clear();
    } else if (!line.empty()) {
      out += (in_text ? "\n" : "<p>") + escape_html(line);
    }
    in_table = row;
    in_text = !row && !line.empty();
  }
  if (in_table) out += "</tbody></table></div>\n";
  if (in_text) out += "</p>\n";
  return out;
}

std::string section_html(const std::string& title, const std::string& body) {
  return "<section><h2>" + escape_html(title) + "</h2>\n" + body + "</section>\n";
}

std::string folded(const std::vector<std::pair<std::string, std::string>>& texts, bool open) {
  std::string out;
  for (const auto& [name, text] : texts)
    out += std::string("<details") + (open ? " open" : "") + "><summary>" + escape_html(name) +
           "</summary><pre>" + escape_html(text) + "</pre></details>\n";
  return out;
}

std::string sections_html(const std::vector<Section>& sections) {
  std::string out;
  for (const Section& section : sections) {
    std::string body = html_of(section.text);
    if (!section.picture.empty()) body += "<div class=\"picture\">" + section.picture + "</div>\n";
    out += section_html(section.title, body + folded(section.quoted, true));
  }
  return out;
}

// ---- curves -------------------------------------------------------------------------------------

using Curve = std::vector<std::pair<double, double>>;

/// [[step, ...], [value, ...]]
Json points_json(const Curve& curve) {
  Json steps = Json::array(), values = Json::array();
  const size_t n = std::min(curve.size(), kMostPoints);
  for (size_t k = 0; k < n; ++k) {
    const auto& [step, value] = curve[n == 1 ? 0 : k * (curve.size() - 1) / (n - 1)];
    steps.push_back(step);
    values.push_back(value);
  }
  return {steps, values};
}

Json curve_json(const std::vector<tables::Compared>& runs, const std::string& name, bool* thinned) {
  Json series = Json::array();
  std::vector<const Curve*> drawn;
  for (size_t r = 0; r < runs.size(); ++r) {
    const auto found = runs[r].curves.find(name);
    if (found == runs[r].curves.end()) continue;
    const auto same = std::find_if(drawn.begin(), drawn.end(),
                                   [&](const Curve* other) { return *other == found->second; });
    if (same != drawn.end()) {
      series[static_cast<size_t>(same - drawn.begin())]["runs"].push_back(r);
      continue;
    }
    *thinned = *thinned || found->second.size() > kMostPoints;
    drawn.push_back(&found->second);
    series.push_back({{"runs", {r}}, {"points", points_json(found->second)}});
  }
  return {{"name", name}, {"series", std::move(series)}};
}

Json curves_json(const std::vector<tables::Compared>& runs, bool* thinned) {
  std::map<std::string, bool> names;
  for (const tables::Compared& run : runs)
    for (const auto& [name, curve] : run.curves) names[name] = true;
  Json out = Json::array();
  for (const auto& [name, there] : names) out.push_back(curve_json(runs, name, thinned));
  return out;
}

std::string curves_html(const Report& report, bool thinned) {
  std::string legend;
  for (size_t r = 0; r < report.runs.size(); ++r)
    legend += "<label style=\"--run:" + tables::colour_of(r) +
              "\"><input type=\"checkbox\" checked data-run=\"" + std::to_string(r) +
              "\"><i></i> " + escape_html(report.runs[r].name) + "</label>\n";
  return "<div class=\"tools\"><label><input id=\"log\" type=\"checkbox\"> logarithmic</label>\n"
         "<label>smoothing <input id=\"smooth\" type=\"range\" min=\"0\" max=\"0.99\" "
         "step=\"0.01\" value=\"0\"></label>\n"
         "<label>show <input id=\"filter\" type=\"search\" placeholder=\"part of a name\"></label>"
         "</div>\n<div class=\"legend\">" +
         legend + "</div>\n<div id=\"charts\"></div>\n" +
         (thinned ? "<p class=\"note\">Of each curve, 1,000 points at most, evenly.</p>\n" : "");
}

// ---- sequences ----------------------------------------------------------------------------------

/// Bytes that are not UTF-8 are replaced.
std::string ascii(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

std::string plays_html(const std::vector<Play>& plays) {
  std::string buttons, pages;
  for (size_t k = 0; k < plays.size(); ++k) {
    buttons += "<button type=\"button\" data-play=\"" + std::to_string(k) + "\">" +
               escape_html(plays[k].title) + "</button>\n";
    pages += "<script id=\"play" + std::to_string(k) + "\" type=\"application/json\">" +
             script_json(ascii(plays[k].page)) + "</script>\n";
  }
  return "<div class=\"tools\">" + buttons +
         "</div>\n<iframe id=\"player\" title=\"source, result and truth\"></iframe>\n" + pages;
}

}  // namespace

std::string page(const Report& report) {
  bool thinned = false;
  const Json curves = curves_json(report.runs, &thinned);
  Json colours = Json::array(), names = Json::array();
  for (size_t r = 0; r < report.runs.size(); ++r) {
    colours.push_back(tables::colour_of(r));
    names.push_back(report.runs[r].name);
  }
  std::string body = sections_html(report.before);
  if (!report.plays.empty()) body += section_html("Sequences", plays_html(report.plays));
  if (!curves.empty()) body += section_html("Curves", curves_html(report, thinned));
  body += sections_html(report.after);
  if (!report.files.empty()) body += section_html("Files", folded(report.files, false));
  const Json data = {{"names", names}, {"colours", colours}, {"curves", curves}};
  const std::string refresh = report.refresh > 0 ? "<meta http-equiv=\"refresh\" content=\"" +
                                                       std::to_string(report.refresh) + "\">\n"
                                                 : "";
  return fill_page(kPage, {{"TITLE", escape_html(report.title)},
                           {"REFRESH", refresh},
                           {"STYLE", kStyle},
                           {"BODY", body},
                           {"DATA", script_json(ascii(data))},
                           {"SCRIPT", kScript}});
}

}  // namespace restage::report
