#include "experiments/sweep/results.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>
#include <tuple>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "nn/metrics/metrics.h"

namespace restage::tables {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr uint64_t kMaxBytes = uint64_t{1} << 28;
constexpr int kMaxDepth = 8;  ///< of an override's value

/// A JSON file whose parts are asked for by kind; everything else is an InputError that names it.
/// Results are read as sorted JSON, which a hostile file cannot make slow; plans as ordered JSON,
/// since the order of a trial's artifacts is that of their making.
template <class Json>
class Reader {
 public:
  Reader(std::string path, std::string fix) : path_(std::move(path)), fix_(std::move(fix)) {}

  Json parse() const {
    Json document = Json::parse(read_file(path_, kMaxBytes), nullptr, false);
    if (document.is_discarded()) fail("is no JSON document");
    return document;
  }
  [[noreturn]] void fail(const std::string& wrong) const { throw InputError(path_, wrong, fix_); }
  void need(bool holds, const std::string& name, const char* what) const {
    if (!holds) fail("'" + name + "' is not " + what);
  }
  /// The entry `name` of an object; null if it is not there.
  const Json& at(const Json& object, const std::string& name) const {
    static const Json null;
    const auto found = object.find(name);
    return found == object.end() ? null : *found;
  }
  std::string text(const Json& object, const std::string& name) const {
    const Json& value = at(object, name);
    need(value.is_string(), name, "text");
    return value.template get<std::string>();
  }
  /// Text; empty for null.
  std::string optional_text(const Json& object, const std::string& name) const {
    return at(object, name).is_null() ? "" : text(object, name);
  }
  uint64_t count(const Json& object, const std::string& name) const {
    const Json& value = at(object, name);
    need(value.is_number_unsigned(), name, "a number from 0");
    return value.template get<uint64_t>();
  }
  const Json& object(const Json& parent, const std::string& name) const {
    const Json& value = at(parent, name);
    need(value.is_object(), name, "a section");
    return value;
  }
  /// Id, case, seed, overrides, artifacts.
  void head(const Json& trial, PlannedTrial* out) const {
    if (!trial.is_object()) fail("holds a trial that is no section");
    out->id = text(trial, "id");
    need(is_trial_id(out->id), "id", "12 hex digits");
    out->case_name = optional_text(trial, "case");
    out->seed = count(trial, "seed");
    for (const auto& [key, value] : object(trial, "overrides").items()) {
      need(depth(value) <= kMaxDepth, "overrides", "so deep elsewhere");
      out->overrides[key] = value;
    }
    for (const auto& [stage, id] : object(trial, "artifacts").items()) {
      need(id.is_string(), "artifacts", "a section of ids");
      out->artifacts.emplace_back(stage, id.template get<std::string>());
    }
  }
  MetricValues values(const Json& entries) const {
    if (!entries.is_object()) fail("holds metrics that are no section");
    MetricValues out;
    for (const metrics::Metric& metric : metrics::table()) {
      const Json& value = at(entries, metric.name);
      if (value.is_null()) continue;
      need(value.is_number(), metric.name, "a number");
      out[metric.name] = value.template get<double>();
    }
    return out;
  }
  Scores scores(const Json& entries) const {
    if (!entries.is_object()) fail("holds a set that is no section");
    Scores out;
    out.mean = values(object(entries, "mean"));
    const Json& sequences = at(entries, "sequences");
    need(sequences.is_array(), "sequences", "a list");
    std::set<std::string> names;
    for (const Json& sequence : sequences) {
      MetricValues found = values(sequence);
      std::string name = text(sequence, "name");
      if (!names.insert(name).second) fail("has the sequence '" + name + "' twice");
      out.sequences.emplace_back(std::move(name), std::move(found));
    }
    return out;
  }
  SetResult set(const Json& entries) const {
    SetResult out{scores(entries), {}};
    const Json& references = at(entries, "references");
    if (references.is_null()) return out;
    need(references.is_object(), "references", "a section");
    for (const auto& [name, one] : references.items())
      out.references.emplace_back(name, scores(one));
    return out;
  }

 private:
  static int depth(const Json& value) {
    if (!value.is_structured()) return 0;
    // Counted level by level: a hostile file must not exhaust the stack.
    std::vector<const Json*> level{&value};
    int levels = 0;
    while (!level.empty() && levels <= kMaxDepth) {
      std::vector<const Json*> next;
      for (const Json* item : level)
        for (const Json& child : *item)
          if (child.is_structured()) next.push_back(&child);
      level = std::move(next);
      ++levels;
    }
    return levels;
  }

  std::string path_, fix_;
};

/// Numbers by size and before text.
bool value_before(const Json& a, const Json& b) {
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

bool same_question(const PlannedTrial& a, const PlannedTrial& b) {
  return a.case_name == b.case_name && a.seed == b.seed && a.overrides == b.overrides;
}

/// The plan's view of its trials is what counts; a result must answer the question that it asks.
TrialResult result_of(const std::string& dir, const std::string& id, const PlannedTrial* planned,
                      Results* results) {
  TrialResult pending;
  if (planned != nullptr) static_cast<PlannedTrial&>(pending) = *planned;
  pending.id = id;
  pending.described = planned != nullptr;
  const std::string path = dir + "/trials/" + id + "/result.json";
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return pending;
  try {
    TrialResult found = read_result(path, id);
    if (planned == nullptr || same_question(found, *planned)) return found;
    throw InputError(path, "its case, seed or overrides are not those of the plan",
                     "it is not used; remove it and run the trial again");
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

bool is_trial_id(const std::string& text) {
  return text.size() == 12 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string plain_text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::optional<std::vector<PlannedTrial>> read_plan(const std::string& dir) {
  const std::string path = dir + "/plan.json";
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return std::nullopt;
  const Reader<nlohmann::ordered_json> reader(
      path, "write it again with 'restage sweep plan SWEEP.yaml --out " + dir + "'");
  const auto document = reader.parse();
  if (!document.is_object() || !reader.at(document, "trials").is_array())
    reader.fail("holds no list of trials");
  std::vector<PlannedTrial> plan;
  std::set<std::string> ids;
  for (const auto& trial : document["trials"]) {
    reader.head(trial, &plan.emplace_back());
    if (!ids.insert(plan.back().id).second)
      reader.fail("has the trial " + plan.back().id + " twice");
  }
  return plan;
}

std::string store_of(const std::string& dir) {
  std::error_code ignored;
  if (!fs::exists(dir + "/plan.json", ignored)) return "";
  const Json plan = Json::parse(read_file(dir + "/plan.json", kMaxBytes), nullptr, false);
  const auto text = [&](const char* key) {
    return plan.is_object() && plan.contains(key) && plan[key].is_string()
               ? plan[key].get<std::string>()
               : "";
  };
  // The store is seen from where the sweep was planned, and that place from the sweep's folder.
  return text("store").empty() ? "" : (fs::path(dir) / text("directory") / text("store")).string();
}

TrialResult read_result(const std::string& path, const std::string& id) {
  const Reader<Json> reader(path, "it is not used; remove it and run the trial again");
  const Json document = reader.parse();
  TrialResult out;
  reader.head(document, &out);
  if (out.id != id) reader.fail("is the result of another trial (" + out.id + ")");
  const std::string state = reader.text(document, "state");
  const auto* over = std::begin(kTrialStates) + 3;  // of which the first three are
  const auto* known = std::find(std::begin(kTrialStates), over, state);
  reader.need(known != over, "state", "one of done, failed and stopped");
  out.state = static_cast<TrialState>(known - std::begin(kTrialStates));
  out.error = reader.optional_text(document, "error");
  const Json& seconds = reader.at(document, "seconds");
  reader.need(seconds.is_number() || seconds.is_null(), "seconds", "a number");
  out.seconds = seconds.is_null() ? 0 : seconds.get<double>();
  if (out.state != TrialState::done) return out;
  for (const auto& [name, set] : reader.object(document, "metrics").items())
    out.sets.emplace_back(name, reader.set(set));
  return out;
}

Results read_results(const std::string& dir) {
  Results out;
  std::optional<std::vector<PlannedTrial>> plan;
  const std::vector<std::string> folders = trial_folders(dir);
  try {
    plan = read_plan(dir);
  } catch (const Error& error) {
    out.notices.emplace_back(error.what());
  }
  std::set<std::string> known;
  if (plan)
    for (const PlannedTrial& trial : *plan) {
      out.trials.push_back(result_of(dir, trial.id, &trial, &out));
      known.insert(trial.id);
    }
  for (const std::string& name : folders) {
    if (known.contains(name)) continue;
    const std::string path = dir + "/trials/" + name;
    if (!is_trial_id(name))
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
