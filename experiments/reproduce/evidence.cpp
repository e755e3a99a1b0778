#include "experiments/reproduce/evidence.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "datasets/readers/sha256.h"
#include "experiments/sweep/json_reader.h"
#include "experiments/sweep/sweep_dir.h"

namespace restage::reproduce {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // entries stay in the order of the sweep that wrote them

bool is_file(const std::string& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::string kept(const Evidence& evidence, const std::string& name) {
  return evidence.folder + "/results/" + name + ".json";
}

constexpr uint64_t kMostBytes = uint64_t{1} << 28;
void copy(const std::string& from, const std::string& to) {
  write_file_atomically(to, read_file(from, kMostBytes));
}

/// The scores of every reference of every set.
std::vector<Json*> references_of(Json& result) {
  std::vector<Json*> out;
  if (const auto metrics = result.find("metrics"); metrics != result.end())
    for (Json& set : *metrics)
      if (const auto references = set.find("references"); references != set.end())
        for (Json& scores : *references) out.push_back(&scores);
  return out;
}

std::string reference_name(const std::string& text) { return sha256(text).substr(0, 12); }

/// A line for each entry, so that a difference shows what differs.
std::string text_of(const Json& document) { return document.dump(0) + "\n"; }

/// Writes the committed form of a result. The machine that made it is nobody's business.
void keep_result(const Evidence& evidence, const std::string& id, const std::string& from) {
  Json document = Json::parse(read_file(from, kMostBytes));
  document.erase("host");
  document.erase("command");
  for (Json* scores : references_of(document)) {
    const std::string text = text_of(*scores);
    const std::string name = reference_name(text);
    const std::string path = kept(evidence, "references/" + name);
    make_folder(evidence.folder + "/results/references");
    if (!is_file(path)) write_file_atomically(path, text);
    *scores = name;
  }
  write_file_atomically(kept(evidence, id), text_of(document));
}

/// A committed result as its trial wrote it. InputError: it is damaged, or one of its references
/// is.
Json kept_result(const Evidence& evidence, const std::string& id) {
  const std::string result = kept(evidence, id);
  const std::string fix = "restore it; without it the result of trial " + id + " is not used";
  const sweep::JsonReader<Json> reader(result, fix);
  Json document = reader.parse();
  for (Json* scores : references_of(document)) {
    if (!scores->is_string()) continue;  // a result.json that was copied by hand has the scores
    const auto name = scores->get<std::string>();
    if (!sweep::is_trial_id(name)) reader.fail("has a reference that is not 12 hex digits");
    const std::string path = kept(evidence, "references/" + name);
    if (!is_file(path)) throw InputError(path, "is not there, and " + result + " needs it", fix);
    const std::string text = read_file(path, kMostBytes);
    if (reference_name(text) != name) throw InputError(path, "is damaged", fix);
    *scores = Json::parse(text, nullptr, false);
  }
  return document;
}

/// All folders with a paper.yaml, sorted.
std::vector<std::string> folders(const std::string& from) {
  std::vector<std::string> out;
  std::error_code code;
  for (fs::directory_iterator at(from, code), end; !code && at != end; at.increment(code))
    if (is_file(at->path().string() + "/paper.yaml")) out.push_back(at->path().filename().string());
  if (code || out.empty())
    throw InputError(from, "holds no experiments with a paper.yaml",
                     "run this in the folder of the clone, or give --experiments FOLDER");
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

std::vector<Evidence> find_evidence(const std::string& from, const std::string& paper,
                                    const std::string& table, const std::string& out) {
  std::vector<Evidence> found;
  std::set<std::string> papers, tables;
  for (const std::string& name : folders(from)) {
    Evidence one{name, from + "/" + name, out + "/" + name, {}};
    one.asked = read_paper_file(one.folder + "/paper.yaml");
    papers.insert(one.asked.paper);
    if (one.asked.paper != paper) continue;
    tables.insert(one.asked.table);
    if (!table.empty() && one.asked.table != table) continue;
    for (const char* budget : kBudgets)
      if (const Budget& b = one.asked.budget(budget); one.runs() && !is_file(one.sweep_file(b)))
        throw InputError(one.folder, "has rows to be run and no " + b.sweep,
                         "write it, or say 'not_run' for each row in paper.yaml");
    found.push_back(std::move(one));
  }
  if (!found.empty()) return found;
  if (tables.empty()) {
    const std::string close = nearest(paper, {papers.begin(), papers.end()});
    throw InputError("", "there are no experiments of " + in_quotes(paper) + " in " + from,
                     close.empty() ? "there are those of " + joined(papers)
                                   : "did you mean " + in_quotes(close) + "?");
  }
  throw InputError("", paper + " has no table " + in_quotes(table) + " here",
                   "there are " + joined(tables));
}

int take_results(const Evidence& evidence) {
  const sweep::SweepDir dir = sweep::read_sweep_dir(evidence.dir);
  int taken = 0;
  for (const sweep::TrialEntry& trial : dir.trials) {
    const std::string path = kept(evidence, trial.id);
    if (!is_file(path)) continue;
    const auto own = sweep::read_result(dir, trial.id);
    if (own && own->state == tables::TrialState::done) continue;
    try {
      const Json document = kept_result(evidence, trial.id);
      if (tables::parse_result(document, path, trial.id).state != tables::TrialState::done)
        continue;
      make_folder(dir.folder(trial.id));
      write_file_atomically(dir.result(trial.id), document.dump(1) + "\n");
      ++taken;
    } catch (const ReadError&) {
      throw;
    } catch (const InputError& error) {
      log_warning(error.what());
    }
  }
  return taken;
}

bool take_plan(const Evidence& evidence, const std::string& budget) {
  if (is_file(evidence.dir + "/plan.json")) return true;
  if (!is_file(kept(evidence, budget))) return false;
  make_folder(evidence.dir + "/trials");
  copy(kept(evidence, budget), evidence.dir + "/plan.json");
  return true;
}

void keep_results(const Evidence& evidence, const std::string& budget) {
  const sweep::SweepDir dir = sweep::read_sweep_dir(evidence.dir);
  make_folder(evidence.folder + "/results");
  for (const sweep::TrialEntry& trial : dir.trials) {
    const auto result = sweep::read_result(dir, trial.id);
    if (result && result->state == tables::TrialState::done && !is_file(kept(evidence, trial.id)))
      keep_result(evidence, trial.id, dir.result(trial.id));
  }
  sweep::PlanFile plan = dir;
  plan.directory = ".";
  plan.store.clear();
  write_file_atomically(kept(evidence, budget), plan_file_text(plan));
}

tables::Results results_of(const Evidence& evidence) {
  if (!is_file(evidence.dir + "/plan.json")) return {};
  return tables::read_results(evidence.dir);
}

}  // namespace restage::reproduce
