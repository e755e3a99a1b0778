#include "experiments/sweep/asking.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "experiments/search/tpe.h"
#include "experiments/sweep/objective.h"
#include "experiments/sweep/sweep_words.h"

namespace restage::sweep {
namespace {

using tables::TrialState;

/// The point of a planned trial.
search::Point point_of(const search::Space& space, const TrialEntry& trial,
                       const std::string& place) {
  search::Point out;
  for (const search::Dimension& dimension : space) {
    const auto found = trial.overrides.find(dimension.key);
    if (found == trial.overrides.end())
      throw InputError(place,
                       "trial " + trial.id + " has no value of " + in_quotes(dimension.key) +
                           ", which is searched now",
                       "another space is another sweep: give another folder");
    out.push_back(coordinate_of(dimension, parse_yaml(found->second.dump(), place, true), place));
  }
  return out;
}

std::vector<search::Told> told_in(const SweepDir& dir, const Search& search) {
  std::vector<search::Told> out;
  for (const TrialEntry& trial : dir.trials)
    out.push_back({point_of(search.space, trial, dir.path + "/plan.json"),
                   value_of(dir, trial, read_result(dir, trial.id), search.metric)});
  return out;
}

/// Lays `key=value` over a point.
void fix(const Search& search, const std::vector<std::string>& words, search::Point* point) {
  std::set<std::string> seen;
  for (const std::string& text : words) {
    const SweepWord word = read_sweep_word(text);
    const std::string place = "override " + in_quotes(text);
    const auto at = std::find_if(search.space.begin(), search.space.end(),
                                 [&](const auto& one) { return one.key == word.key; });
    if (at == search.space.end())
      throw InputError(place, "is no key that is searched",
                       "the keys are " + cut_list(search.space, 200, &search::Dimension::key));
    if (word.several) throw InputError(place, "has several values", "ask once for each");
    if (!seen.insert(word.key).second)
      throw InputError(place, "gives the key a second time", "keep one");
    (*point)[static_cast<size_t>(at - search.space.begin())] =
        coordinate_of(*at, word.values[0], place);
  }
}

SweepFile searching_file(const SweepDir& dir) {
  SweepFile file = read_planned_file(dir);
  if (!file.search || !file.search->asks())
    throw InputError(dir.path, "its sweep asks for no trials: all of them are planned",
                     "run them, or plan a sweep with search: {kind: tpe, ...}");
  return file;
}

}  // namespace

std::vector<search::Point> asked_in(const std::string& dir, const search::Space& space) {
  std::vector<search::Point> out;
  const auto plan = read_plan_file(dir);
  if (!plan) return out;
  for (const TrialEntry& trial : plan->trials)
    out.push_back(point_of(space, trial, dir + "/plan.json"));
  return out;
}

std::optional<Question> ask(const std::string& path, const std::vector<std::string>& words,
                            int up_to) {
  SweepDir dir = enter_sweep_dir(path);
  SweepFile file = searching_file(dir);
  Lease lease = lease_plan(dir.path);
  static_cast<PlanFile&>(dir) = read_sweep_dir(dir.path);  // as it is now that nobody else asks
  if (up_to > 0 && std::ssize(dir.trials) >= up_to) {
    lease.forget();
    return std::nullopt;
  }
  Search& search = *file.search;
  const std::vector<search::Told> told = told_in(dir, search);
  auto point = search::propose(search.space, told, {search.seed, search.startup});
  if (!point) {
    lease.forget();
    return std::nullopt;
  }
  fix(search, words, &*point);
  for (size_t i = 0; i < told.size(); ++i)
    if (told[i].point == *point)
      throw InputError("", "trial " + dir.trials[i].id + " has these values already",
                       "ask for others, or tell what it came to");
  search.asked = {std::move(*point)};
  const SweepPlan plan = plan_sweep(file);
  const PlannedTrial& trial = plan.trials.at(0);
  for (const TrialEntry& other : dir.trials)
    if (other.id == trial.id)
      throw InputError(search.place.text(),
                       "gives the trial " + trial.id + " a second time, with other values",
                       "take keys out of 'space' that change no result (names, logging)");
  add_trial(dir, trial);
  lease.forget();
  return Question{entry_of(trial), static_cast<int>(told.size()) + 1};
}

void tell(const std::string& path, const std::string& id, std::optional<double> value,
          const std::string& error) {
  const SweepDir dir = read_sweep_dir(path);
  const TrialEntry& trial = dir.trial(id);
  std::optional<Lease> lease = Lease::take(dir.lease(id), "telling");
  if (!lease) {
    const auto holder = Lease::holder(dir.lease(id));
    throw WorkError("trial " + id + " is being run by " +
                    (holder ? holder->text() : std::string("somebody who has just ended")) +
                    "; wait for it, or stop it first");
  }
  const auto before = read_result(dir, id);
  if (value && before && before->state == TrialState::done) {
    auto document = Json::parse(read_file(dir.result(id)));
    document["told"] = *value;
    write_file_atomically(dir.result(id),
                          document.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  } else {
    TrialOutcome outcome;
    outcome.told = value;
    write_result(dir, trial, value ? TrialState::done : TrialState::failed, error, outcome, 0);
  }
  lease->forget();
}

}  // namespace restage::sweep
