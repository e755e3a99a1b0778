#include "experiments/sweep/results.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>
#include <tuple>

#include "autograd/base/error.h"
#include "nn/metrics/metrics.h"

namespace restage::tables {
namespace {

namespace fs = std::filesystem;
using SortedJson = nlohmann::json;

constexpr const char* kFix = "it is not used; remove it and run the trial again";

/// Reads the scores of a result.
class ResultReader : public sweep::JsonReader<SortedJson> {
 public:
  using JsonReader::JsonReader;

  MetricValues values(const SortedJson& entries) const {
    if (!entries.is_object()) fail("holds metrics that are no section");
    MetricValues out;
    for (const metrics::Metric& metric : metrics::recorded()) {
      const SortedJson& value = at(entries, metric.name);
      if (value.is_null()) continue;
      need(value.is_number(), metric.name, "a number");
      out[metric.name] = value.template get<double>();
    }
    return out;
  }
  Scores scores(const SortedJson& entries) const {
    if (!entries.is_object()) fail("holds a set that is no section");
    Scores out;
    out.mean = values(section(entries, "mean"));
    std::set<std::string> names;
    for (const SortedJson& sequence : list(entries, "sequences")) {
      MetricValues found = values(sequence);
      std::string name = text(sequence, "name");
      if (!names.insert(name).second) fail("has the sequence '" + name + "' twice");
      out.sequences.emplace_back(std::move(name), std::move(found));
    }
    return out;
  }
  StageCurves stage(const SortedJson& entry) const {
    need(entry.is_object(), "training", "a section for each stage");
    StageCurves out;
    for (const auto& [name, number] :
         {std::pair{"steps", &out.steps}, std::pair{"batch", &out.batch}})
      if (const SortedJson& value = at(entry, name); !value.is_null()) {
        need(value.is_number_unsigned(), name, "a whole number");
        *number = value.get<int64_t>();
      }
    for (const SortedJson& curve : list(entry, "curves")) {
      Curve points;
      for (const SortedJson& point : list(curve, "points")) {
        need(point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number(),
             "points", "pairs of a step and a value");
        need(points.empty() || points.back().first < point[0].get<double>(), "points",
             "pairs whose steps rise");
        points.emplace_back(point[0].get<double>(), point[1].get<double>());
      }
      out.curves.emplace_back(text(curve, "figure"), std::move(points));
    }
    return out;
  }
  SetResult set(const SortedJson& entries) const {
    SetResult out{scores(entries)};
    for (const SortedJson& sequence : list(entries, "sequences"))
      if (const SortedJson& frames = at(sequence, "frames"); frames.is_number_integer())
        out.frames[text(sequence, "name")] = frames.template get<int64_t>();
    if (const SortedJson& joints = at(entries, "joints"); joints.is_object())
      for (const auto& [name, value] : joints.items()) {
        need(value.is_number(), name, "a number");
        out.joints[name] = value.template get<double>();
      }
    const SortedJson& references = at(entries, "references");
    if (references.is_null()) return out;
    need(references.is_object(), "references", "a section");
    for (const auto& [name, one] : references.items())
      out.references.emplace_back(name, scores(one));
    return out;
  }
};

/// Numbers by size and before text.
bool value_before(const SortedJson& a, const SortedJson& b) {
  if (a.is_number() && b.is_number()) return a.get<double>() < b.get<double>();
  if (a.is_number() != b.is_number()) return a.is_number();
  return a.dump() < b.dump();
}

bool trial_before(const TrialResult& a, const TrialResult& b) {
  if (a.case_name != b.case_name) return a.case_name < b.case_name;
  auto x = a.overrides.begin(), y = b.overrides.begin();
  for (; x != a.overrides.end() && y != b.overrides.end(); ++x, ++y) {
    if (x->first != y->first) return x->first < y->first;
    if (x->second != y->second) return value_before(x->second, y->second);
  }
  if ((x == a.overrides.end()) != (y == b.overrides.end())) return x == a.overrides.end();
  return std::tie(a.seed, a.id) < std::tie(b.seed, b.id);
}

/// Names of the folders in DIR/trials, sorted; a leading dot hides what is being made.
std::vector<std::string> trial_folders(const std::string& dir) {
  std::vector<std::string> names;
  std::error_code code;
  for (fs::directory_iterator at(dir + "/trials", code), end; !code && at != end;
       at.increment(code))
    if (std::error_code ignored; at->is_directory(ignored)) {
      std::string name = at->path().filename().string();
      if (!name.starts_with(".")) names.push_back(std::move(name));
    }
  if (code)
    throw InputError(dir, "holds no trials (" + code.message() + ")",
                     "give a folder that 'restage sweep run' or 'sweep plan --out' wrote");
  std::sort(names.begin(), names.end());
  return names;
}

bool same_question(const sweep::TrialEntry& a, const sweep::TrialEntry& b) {
  return a.case_name == b.case_name && a.seed == b.seed && a.overrides == b.overrides;
}

/// The plan's view of its trials is what counts; a result must answer the question that it asks.
TrialResult result_of(const std::string& dir, const std::string& id,
                      const sweep::TrialEntry* planned, Results* results) {
  TrialResult pending;
  if (planned != nullptr) static_cast<sweep::TrialEntry&>(pending) = *planned;
  pending.id = id;
  pending.described = planned != nullptr;
  const std::string path = dir + "/trials/" + id + "/result.json";
  if (!is_there(path)) return pending;
  try {
    TrialResult found = read_result(path, id);
    if (planned == nullptr || same_question(found, *planned)) return found;
    throw InputError(path, "its case, seed or overrides are not those of the plan",
                     "it is not used; remove it and run the trial again");
  } catch (const ReadError&) {
    throw;
  } catch (const Error& error) {
    results->notices.emplace_back(error.what());
    pending.state = TrialState::damaged;
  }
  return pending;
}

/// Without a plan, two trials may ask the same: one of a base that was edited since.
void tell_repeated(const Results& all, std::vector<std::string>* notices) {
  for (size_t i = 1; i < all.trials.size(); ++i)
    if (all.trials[i - 1].described && all.trials[i].described &&
        same_question(all.trials[i - 1], all.trials[i]))
      notices->push_back("trials " + all.trials[i - 1].id + " and " + all.trials[i].id +
                         " have the same case, overrides and seed, and both are used; remove the "
                         "folder of the one whose base is no longer meant");
}

}  // namespace

int Results::count(TrialState state) const {
  return static_cast<int>(std::count_if(trials.begin(), trials.end(),
                                        [&](const TrialResult& t) { return t.state == state; }));
}

std::string plain_text(const SortedJson& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

TrialResult read_result(const std::string& path, const std::string& id) {
  return parse_result(ResultReader(path, kFix).parse(), path, id);
}

TrialResult parse_result(const SortedJson& document, const std::string& path,
                         const std::string& id) {
  const ResultReader reader(path, kFix);
  TrialResult out{read_entry<SortedJson>(reader, document)};
  if (out.id != id) reader.fail("is the result of another trial (" + out.id + ")");
  const std::string state = reader.text(document, "state");
  const auto* over = std::begin(kTrialStates) + 3;  // of which the first three are
  const auto* known = std::find(std::begin(kTrialStates), over, state);
  reader.need(known != over, "state", "one of done, failed and stopped");
  out.state = static_cast<TrialState>(known - std::begin(kTrialStates));
  out.error = reader.optional_text(document, "error");
  if (!reader.at(document, "seconds").is_null()) out.seconds = reader.number(document, "seconds");
  out.host = reader.optional_text(document, "host");
  out.command = reader.optional_text(document, "command");
  if (!reader.at(document, "told").is_null()) out.told = reader.number(document, "told");
  out.early_stop = reader.at(document, "early_stop");
  if (out.state != TrialState::done) return out;
  if (!reader.at(document, "training").is_null())
    for (const auto& [name, stage] : reader.section(document, "training").items())
      out.training.emplace(name, reader.stage(stage));
  out.sets = parse_sets(reader.section(document, "metrics"), path, kFix);
  return out;
}

std::vector<std::pair<std::string, SetResult>> parse_sets(const SortedJson& metrics,
                                                          const std::string& path,
                                                          const std::string& mend) {
  const ResultReader reader(path, mend);
  std::vector<std::pair<std::string, SetResult>> out;
  for (const auto& [name, set] : metrics.items()) out.emplace_back(name, reader.set(set));
  return out;
}

Results read_results(const std::string& dir) {
  Results out;
  std::optional<sweep::PlanFile> plan;
  const std::vector<std::string> folders = trial_folders(dir);
  try {
    plan = sweep::read_plan_file(dir);
  } catch (const ReadError&) {
    throw;
  } catch (const Error& error) {
    out.notices.emplace_back(error.what());
  }
  std::set<std::string> known;
  if (plan)
    for (const sweep::TrialEntry& trial : plan->trials) {
      out.trials.push_back(result_of(dir, trial.id, &trial, &out));
      known.insert(trial.id);
    }
  for (const std::string& name : folders) {
    if (known.contains(name)) continue;
    const std::string path = dir + "/trials/" + name;
    if (!sweep::is_trial_id(name))
      out.notices.push_back(path + ": is no trial's folder; it is not used, remove it");
    else if (plan)
      out.notices.push_back(path +
                            ": is not in the plan as it stands (an edited configuration is "
                            "another trial); it is not used, and may be removed");
    else
      out.trials.push_back(result_of(dir, name, nullptr, &out));
  }
  if (!plan) {
    std::sort(out.trials.begin(), out.trials.end(), trial_before);
    tell_repeated(out, &out.notices);
  }
  return out;
}

}  // namespace restage::tables
