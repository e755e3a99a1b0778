#include "experiments/sweep/table.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "autograd/base/words.h"

namespace restage::tables {
namespace {

using SortedJson = nlohmann::json;

/// The trials of one row, in order.
struct Group {
  std::map<std::string, SortedJson> key;  ///< what they were grouped by; the case as "case"
  std::vector<const TrialResult*> trials;
  std::string reference;  ///< its values of this reference; empty: the trials' own
};

template <class Words>
std::string quoted_list(const Words& words) {
  return joined(words, [](const std::string& word) { return "'" + word + "'"; });
}

// ---- groups ------------------------------------------------------------------------------------

/// Overrides beside the case; a seed among them is no key of a row.
std::map<std::string, SortedJson> keys_of(const TrialResult& trial) {
  std::map<std::string, SortedJson> keys = trial.overrides;
  keys.erase("seed");
  if (!trial.case_name.empty()) keys["case"] = trial.case_name;
  return keys;
}

void check_keys(const Results& results, const std::vector<std::string>& rows) {
  std::set<std::string> known;
  for (const TrialResult& trial : results.trials)
    for (const auto& [key, value] : keys_of(trial)) known.insert(key);
  const std::vector<std::string> names(known.begin(), known.end());
  for (const std::string& row : rows) {
    if (known.contains(row)) continue;
    const std::string near = nearest(row, names);
    throw InputError("", "no trial has the key '" + row + "' to make rows of",
                     !near.empty()   ? "did you mean '" + near + "'?"
                     : names.empty() ? "these trials have neither cases nor overrides"
                                     : "there are " + quoted_list(names));
  }
}

std::vector<Group> group(const Results& results, const std::vector<std::string>& rows) {
  check_keys(results, rows);
  std::vector<Group> groups;
  for (const TrialResult& trial : results.trials) {
    if (!trial.described) continue;
    std::map<std::string, SortedJson> key = keys_of(trial);
    if (!rows.empty())
      std::erase_if(key, [&](const auto& item) {
        return std::find(rows.begin(), rows.end(), item.first) == rows.end();
      });
    auto at =
        std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.key == key; });
    if (at == groups.end()) at = groups.insert(at, {key, {}, ""});
    at->trials.push_back(&trial);
  }
  return groups;
}

std::string reference_label(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// A row for each reference that some trial was measured beside, of all trials.
std::vector<Group> reference_groups(const Results& results) {
  std::vector<Group> out;
  for (const TrialResult& trial : results.trials)
    for (const auto& [set, values] : trial.sets)
      for (const auto& reference : values.references) {
        auto at = std::find_if(out.begin(), out.end(),
                               [&](const Group& g) { return g.reference == reference.first; });
        if (at == out.end()) at = out.insert(at, {{}, {}, reference.first});
        if (at->trials.empty() || at->trials.back() != &trial) at->trials.push_back(&trial);
      }
  return out;
}

// ---- labels ------------------------------------------------------------------------------------

/// Whether all rows agree about a key.
bool is_common(const std::vector<Group>& groups, const std::string& key) {
  for (const Group& g : groups) {
    const auto here = g.key.find(key), first = groups.front().key.find(key);
    if ((here == g.key.end()) != (first == groups.front().key.end())) return false;
    if (here != g.key.end() && here->second != first->second) return false;
  }
  return true;
}

/// Whether the name of the case says what a key is.
bool follows_from_case(const std::vector<Group>& groups, const std::string& key) {
  std::map<std::string, SortedJson> of_case;
  for (const Group& g : groups) {
    const auto name = g.key.find("case"), value = g.key.find(key);
    if (name == g.key.end()) return false;
    const SortedJson here = value == g.key.end() ? SortedJson() : value->second;
    if (of_case.emplace(name->second.get<std::string>(), here).first->second != here) return false;
  }
  return true;
}

/// The case, then the keys that tell rows apart and do not follow from the case.
std::vector<std::string> labels(const std::vector<Group>& groups) {
  std::vector<std::string> out;
  std::set<std::string> taken;
  for (const Group& g : groups) {
    std::vector<std::string> parts;
    if (g.key.contains("case")) parts.push_back(plain_text(g.key.at("case")));
    for (const auto& [key, value] : g.key)
      if (key != "case" && !is_common(groups, key) && !follows_from_case(groups, key))
        parts.push_back(key + "=" + plain_text(value));
    const std::string label = parts.empty() ? "base" : joined(parts);
    std::string unique = label;
    for (int i = 2; !taken.insert(unique).second; ++i) unique = label + " #" + std::to_string(i);
    out.push_back(unique);
  }
  return out;
}

size_t find_row(const std::vector<Row>& rows, const std::string& wanted) {
  std::vector<size_t> found;
  std::vector<std::string> names;
  for (size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].label == wanted) return r;
    if (rows[r].label.starts_with(wanted)) found.push_back(r);
    names.push_back(rows[r].label);
  }
  if (found.size() == 1) return found.front();
  throw InputError("",
                   "'" + wanted + "' is the beginning of " +
                       (found.empty() ? "no row" : std::to_string(found.size()) + " rows"),
                   names.empty() ? "there are no rows" : "the rows are " + quoted_list(names));
}

// ---- cells -------------------------------------------------------------------------------------

std::vector<const metrics::Metric*> columns(const std::vector<std::string>& names) {
  std::vector<const metrics::Metric*> out;
  std::vector<std::string> known;
  for (const metrics::Metric& metric : metrics::recorded()) known.emplace_back(metric.name);
  if (names.empty())
    for (const metrics::Metric& metric : metrics::table()) out.push_back(&metric);
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      const std::string near = nearest(name, known);
      throw InputError(
          "", "there is no metric '" + name + "'",
          near.empty() ? "there are " + quoted_list(known) : "did you mean '" + near + "'?");
    }
    out.push_back(&metrics::recorded()[static_cast<size_t>(at - known.begin())]);
  }
  return out;
}

/// What pairs a trial with one of another row: the seed, and what the rows do not name.
std::string pair_key(const TrialResult& trial, const Group& group) {
  std::string key = "seed " + std::to_string(trial.seed);
  for (const auto& [name, value] : keys_of(trial))
    if (!group.key.contains(name)) key += "\n" + name + "=" + value.dump();
  return key;
}

template <class Values>
const Values* find(const std::vector<std::pair<std::string, Values>>& list,
                   const std::string& name) {
  for (const auto& [key, values] : list)
    if (key == name) return &values;
  return nullptr;
}

/// `reference`: of the same trials, instead of the group's own values.
Sample sample_of(const Group& group, const std::string& reference, const std::string& set,
                 const std::string& metric) {
  Sample sample;
  for (const TrialResult* trial : group.trials) {
    const SetResult* measured = find(trial->sets, set);
    const Scores* found = measured;
    if (measured != nullptr && !reference.empty()) found = find(measured->references, reference);
    if (found == nullptr || !found->mean.contains(metric)) continue;
    Repetition r{pair_key(*trial, group), found->mean.at(metric), {}};
    for (const auto& [name, values] : found->sequences)
      if (values.contains(metric)) r.sequences[name] = values.at(metric);
    sample.push_back(std::move(r));
  }
  return sample;
}

/// Trials that share what a reference depends on (an extractor, or nothing) measured it again.
Sample without_repeats(const Sample& sample) {
  Sample out;
  for (const Repetition& r : sample)
    if (std::none_of(out.begin(), out.end(), [&](const Repetition& o) {
          return o.mean == r.mean && o.sequences == r.sequences;
        }))
      out.push_back(r);
  return out;
}

/// Differences are taken in pairs of one and the same trial where one side is a reference.
Estimate difference(const Group& row, const Group& against, const std::string& set,
                    const std::string& metric) {
  const Group& trials = row.reference.empty() ? row : against;
  const bool beside = row.reference.empty() != against.reference.empty();
  Sample pairs =
      paired_difference(sample_of(beside ? trials : row, row.reference, set, metric),
                        sample_of(beside ? trials : against, against.reference, set, metric));
  const bool references = !row.reference.empty() && !against.reference.empty();
  return estimate(references ? without_repeats(pairs) : pairs);
}

Row head_of(const Group& group, const std::string& label) {
  Row row;
  row.label = label;
  row.reference = !group.reference.empty();
  if (row.reference) return row;
  row.overrides = group.trials.front()->overrides;
  row.case_name = group.trials.front()->case_name;
  for (const TrialResult* trial : group.trials) {
    std::erase_if(row.overrides, [&](const auto& item) {
      const auto same = trial->overrides.find(item.first);
      return same == trial->overrides.end() || same->second != item.second;
    });
    if (trial->case_name != row.case_name) row.case_name.clear();
    if (trial->state == TrialState::done) {
      row.seeds.push_back(trial->seed);
      ++row.n;
    }
  }
  std::sort(row.seeds.begin(), row.seeds.end());
  row.seeds.erase(std::unique(row.seeds.begin(), row.seeds.end()), row.seeds.end());
  return row;
}

void tell_pooled(const std::vector<Group>& groups, std::vector<std::string>* notices) {
  std::set<std::string> pooled;
  for (const Group& g : groups)
    for (const TrialResult* trial : g.trials)
      for (const auto& [key, value] : keys_of(*trial))
        if (!g.key.contains(key) && keys_of(*g.trials.front())[key] != value) pooled.insert(key);
  if (!pooled.empty())
    notices->push_back("rows pool trials that differ in " + quoted_list(pooled) +
                       ", and each of them counts as a repetition; name these keys in --rows to "
                       "tell them apart");
}

void tell_averaged(const Results& results, Table* table) {
  std::vector<std::string> averaged;
  for (const Row& row : table->rows)
    for (const std::string& set : table->sets)
      if (row.reference && !reference_by_case(results, set, row.label).empty())
        averaged.push_back(row.label + " on " + set);
  if (!averaged.empty())
    table->notices.push_back("not the same beside all rows, so that their lines are averages: " +
                             quoted_list(averaged) + "; --against takes each row's own");
}

/// Metric by metric of one set, for all rows.
void fill_set(const std::vector<Group>& groups, size_t set, Table* table) {
  double contradiction = 0;
  const std::string& name = table->sets[set];
  for (size_t c = 0; c < table->columns.size(); ++c)
    for (size_t r = 0; r < groups.size(); ++r) {
      const Group& group = groups[r];
      const std::string metric = table->columns[c]->name;
      Cell& cell = table->rows[r].cells[set][c];
      Sample sample = sample_of(group, group.reference, name, metric);
      contradiction = std::max(contradiction, largest_contradiction(sample));
      if (!group.reference.empty()) sample = without_repeats(sample);
      cell.value = estimate(sample);
      if (table->against && r != *table->against)
        cell.difference = difference(group, groups[*table->against], name, metric);
    }
  if (contradiction > 1e-6)
    table->notices.push_back("set '" + table->sets[set] +
                             "': some means are not the averages of their sequences; means are "
                             "given as told, intervals are those of sequences shifted to them");
}

/// What a reader of differences must know.
void tell_few(Table* table) {
  constexpr int kEnoughSeeds = 5;
  std::vector<std::string> few, two;
  for (const Row& row : table->rows) {
    if (!row.reference && row.n == 2) two.push_back(row.label);
    if (!row.reference && row.n > 0 && row.n < kEnoughSeeds) few.push_back(row.label);
  }
  if (!two.empty())
    table->notices.push_back(
        "two trials stand behind " + quoted_list(two) +
        ": with n = 2 an interval rests on a single difference and is so wide (12.7 standard "
        "errors of the seeds) that it says little; add a third seed at least");
  if (table->against && !few.empty())
    table->notices.push_back("fewer than five trials stand behind " + quoted_list(few) +
                             ": small differences cannot be told; add seeds=1,2,3,4,5");
}

}  // namespace

std::map<std::string, MetricValues> reference_by_case(const Results& results,
                                                      const std::string& set,
                                                      const std::string& label) {
  std::map<std::string, MetricValues> sums;
  std::map<std::pair<std::string, std::string>, int> counts;
  std::map<std::pair<uint64_t, std::string>, double> first;
  bool agree = true;
  for (const TrialResult& trial : results.trials) {
    const SetResult* measured = find(trial.sets, set);
    if (measured == nullptr) continue;
    for (const auto& [name, scores] : measured->references) {
      if (reference_label(name) != label) continue;
      for (const auto& [metric, value] : scores.mean) {
        sums[trial.case_name][metric] += value;
        ++counts[{trial.case_name, metric}];
        const double before = first.try_emplace({trial.seed, metric}, value).first->second;
        agree = agree && std::abs(value - before) <= 1e-6 * std::abs(before);
      }
    }
  }
  if (agree) return {};
  for (auto& [name, values] : sums)
    for (auto& [metric, sum] : values) sum /= counts[{name, metric}];
  return sums;
}

Table make_table(const Results& results, const TableOptions& options) {
  Table table;
  table.columns = columns(options.columns);
  std::vector<Group> groups = group(results, options.rows);
  std::set<std::string> known;
  for (const TrialResult& trial : results.trials)
    for (const auto& [name, set] : trial.sets)
      if (known.insert(name).second) table.sets.push_back(name);
  std::vector<std::string> names = labels(groups);
  for (Group& reference : reference_groups(results)) {
    names.push_back(reference_label(reference.reference));
    groups.push_back(std::move(reference));
    ++table.references;
  }
  for (size_t r = 0; r < groups.size(); ++r) {
    Row& row = table.rows.emplace_back(head_of(groups[r], names[r]));
    row.cells.assign(table.sets.size(), std::vector<Cell>(table.columns.size()));
  }
  if (!options.against.empty()) table.against = find_row(table.rows, options.against);
  tell_pooled({groups.begin(), groups.end() - static_cast<std::ptrdiff_t>(table.references)},
              &table.notices);
  for (size_t s = 0; s < table.sets.size(); ++s) fill_set(groups, s, &table);
  tell_averaged(results, &table);
  tell_few(&table);
  return table;
}

}  // namespace restage::tables
