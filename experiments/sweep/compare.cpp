#include "experiments/sweep/compare.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/words.h"
#include "experiments/sweep/results.h"
#include "experiments/sweep/svg.h"
#include "experiments/sweep/table_formats.h"
#include "experiments/text.h"
#include "nn/config/config_tree.h"

namespace restage::tables {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Lists of plain values stay whole; sections and lists of sections are walked.
void flatten(const ConfigNode& node, const std::string& key,
             std::map<std::string, std::string>* out) {
  const bool walked = std::any_of(node.children.begin(), node.children.end(), [](const auto& c) {
    return c.kind == ConfigNode::Kind::map || c.kind == ConfigNode::Kind::list;
  });
  if (node.kind == ConfigNode::Kind::scalar) {
    (*out)[key] = node.text;
  } else if (node.kind == ConfigNode::Kind::null) {
    (*out)[key] = "null";
  } else if (node.kind == ConfigNode::Kind::list && !walked) {
    const auto text = [](const ConfigNode& item) {
      return item.kind == ConfigNode::Kind::null ? std::string("null") : item.text;
    };
    (*out)[key] = "[" + joined(node.children, text) + "]";
  } else {
    for (size_t i = 0; i < node.children.size(); ++i) {
      const ConfigNode& child = node.children[i];
      const std::string name = child.key.empty() ? std::to_string(i) : child.key;
      flatten(child, key.empty() ? name : key + "." + name, out);
    }
  }
}

/// Adds the lines of a metrics.jsonl, if it is there.
void read_curves(const std::string& path, Compared* out) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return;
  std::istringstream lines(read_file(path));
  for (std::string line; std::getline(lines, line);) {
    const auto entry = nlohmann::json::parse(line, nullptr, false);
    if (!entry.is_object() || !entry.contains("step") || !entry["step"].is_number()) continue;
    const bool staged = entry.contains("stage") && entry["stage"].is_string();
    const std::string prefix = staged ? entry["stage"].get<std::string>() + "." : "";
    for (const auto& [name, value] : entry.items())
      if (name != "step" && value.is_number())
        out->curves[prefix + name].emplace_back(entry["step"].get<double>(), value.get<double>());
  }
}

/// The figures of a trial that is over, and the curves of the artifacts that it used.
void read_trial(const fs::path& folder, Compared* out) {
  const TrialResult result =
      read_result((folder / "result.json").string(), folder.filename().string());
  for (const auto& [set, values] : result.sets)
    for (const auto& [name, value] : values.mean) out->figures[set + ": " + name] = value;
  const fs::path dir = folder.parent_path().parent_path();
  const auto plan = sweep::read_plan_file(dir.string());
  if (!plan || plan->store.empty()) return;
  const std::string store = dir / plan->directory / plan->store;
  for (const auto& [stage, id] : result.artifacts)
    if (sweep::is_trial_id(id) && stage.find('/') == std::string::npos)
      read_curves(store + "/" + stage + "-" + id + "/metrics.jsonl", out);
}

std::string value_or_dash(const Compared& run, const std::string& key) {
  const auto found = run.config.find(key);
  return found == run.config.end() ? "-" : found->second;
}

std::vector<std::string> figure_names(const std::vector<Compared>& all) {
  std::set<std::string> names;
  for (const Compared& run : all)
    for (const auto& [name, value] : run.figures) names.insert(name);
  return {names.begin(), names.end()};
}

void draw_panel(const std::vector<Compared>& all, const std::string& name, double x, double y,
                Svg* svg) {
  constexpr double kWidth = 300, kHeight = 150;
  double first = 1e300, last = -1e300, low = 1e300, high = -1e300;
  for (const Compared& run : all)
    if (const auto curve = run.curves.find(name); curve != run.curves.end())
      for (const auto& [step, value] : curve->second) {
        first = std::min(first, step), last = std::max(last, step);
        low = std::min(low, value), high = std::max(high, value);
      }
  const Axis across(first, last, x, x + kWidth), up(low, high, y + kHeight, y);
  svg->text(x, y - 8, name, "start", 12);
  for (const double mark : up.marks()) {
    svg->line(x, up.at(mark), x + kWidth, up.at(mark), "#ddd");
    svg->text(x - 5, up.at(mark) + 4, short_number(mark), "end", 10, "#555");
  }
  for (const double mark : across.marks())
    svg->text(across.at(mark), y + kHeight + 14, short_number(mark), "middle", 10, "#555");
  for (size_t i = 0; i < all.size(); ++i) {
    const auto curve = all[i].curves.find(name);
    if (curve == all[i].curves.end()) continue;
    std::vector<std::pair<double, double>> points;
    for (const auto& [step, value] : curve->second)
      points.emplace_back(across.at(step), up.at(value));
    if (points.size() == 1) svg->dot(points[0].first, points[0].second, 3, colour_of(i));
    svg->polyline(points, colour_of(i));
  }
}

}  // namespace

Compared read_compared(const std::string& folder) {
  Compared out;
  out.name = folder;
  const std::string config = folder + "/config.yaml";
  std::error_code ignored;
  if (!fs::exists(config, ignored))
    throw InputError(folder, "is neither a run nor a trial (it has no config.yaml)",
                     "give folders of 'restage train' or DIR/trials/ID of a sweep");
  flatten(parse_yaml(read_file(config, kConfigMaxBytes), config), "", &out.config);
  read_curves(folder + "/metrics.jsonl", &out);
  if (fs::exists(folder + "/result.json", ignored)) read_trial(fs::canonical(folder), &out);
  for (const auto& [name, curve] : out.curves) out.figures[name] = curve.back().second;
  return out;
}

std::vector<std::string> differing_keys(const std::vector<Compared>& all) {
  std::set<std::string> keys;
  for (const Compared& run : all)
    for (const auto& [key, value] : run.config) keys.insert(key);
  std::vector<std::string> out;
  for (const std::string& key : keys) {
    const auto same = [&](const Compared& run) {
      const auto a = run.config.find(key), b = all.front().config.find(key);
      const bool here = a != run.config.end(), there = b != all.front().config.end();
      return here == there && (!here || a->second == b->second);
    };
    if (!std::all_of(all.begin(), all.end(), same)) out.push_back(key);
  }
  return out;
}

std::string comparison_markdown(const std::vector<Compared>& all) {
  std::vector<std::vector<std::string>> rows{{"what differs"}}, figures{{"at the end"}};
  for (auto* table : {&rows, &figures})
    for (const Compared& run : all) table->front().push_back(for_markdown(run.name));
  for (const std::string& key : differing_keys(all)) {
    auto& row = rows.emplace_back(std::vector<std::string>{for_markdown(key)});
    for (const Compared& run : all) row.push_back(for_markdown(value_or_dash(run, key)));
  }
  for (const std::string& name : figure_names(all)) {
    auto& row = figures.emplace_back(std::vector<std::string>{for_markdown(name)});
    for (const Compared& run : all)
      row.push_back(run.figures.contains(name) ? short_number(run.figures.at(name)) : "-");
  }
  if (rows.size() == 1) return "The configurations are the same.\n\n" + markdown_table(figures);
  return markdown_table(rows) + "\n" + markdown_table(figures);
}

Json comparison_json(const std::vector<Compared>& all) {
  Json differs = Json::object(), runs = Json::array();
  for (const std::string& key : differing_keys(all)) {
    Json& values = differs[key] = Json::array();
    for (const Compared& run : all)
      values.push_back(run.config.contains(key) ? Json(run.config.at(key)) : Json());
  }
  for (const Compared& run : all) runs.push_back({{"name", run.name}, {"metrics", run.figures}});
  return {{"differs", std::move(differs)}, {"runs", std::move(runs)}};
}

std::string comparison_svg(const std::vector<Compared>& all) {
  constexpr size_t kColumns = 3;
  std::set<std::string> names;
  for (const Compared& run : all)
    for (const auto& [name, curve] : run.curves) names.insert(name);
  Svg svg;
  const double top = 20 + 16 * static_cast<double>(all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    const double y = 16 + 16 * static_cast<double>(i);
    svg.line(12, y - 4, 36, y - 4, colour_of(i), 2);
    svg.text(42, y, all[i].name);
  }
  size_t at = 0;
  for (const std::string& name : names) {
    draw_panel(all, name, 60 + 370 * static_cast<double>(at % kColumns),
               top + 30 + 210 * static_cast<double>(at / kColumns), &svg);
    ++at;
  }
  const auto across = static_cast<double>(std::clamp<size_t>(at, 1, kColumns));
  const auto down = static_cast<double>((at + kColumns - 1) / kColumns);
  return svg.document(10 + 370 * across, top + 20 + 210 * down);
}

}  // namespace restage::tables
