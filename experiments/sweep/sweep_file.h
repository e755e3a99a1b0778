// A sweep file as it was written: which configurations, with which values, judged on what. Reading
// it is strict (unknown keys, lists of unequal length, a key given twice); what the keys mean to a
// configuration is found out by planning (plan.h). Every value knows the line that it comes from.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/search_section.h"
#include "nn/config/config_tree.h"

namespace restage::sweep {

/// `key: value` of a configuration. The key is dotted and full; `value.key_place` says where it
/// stands.
struct Setting {
  std::string key;
  ConfigNode value;
};
using Settings = std::vector<Setting>;

/// Keys that move together, each with as many values: one key for an entry of `grid`.
struct Axis {
  std::vector<std::string> keys;
  std::vector<Settings> points;  ///< one value for each key
};

struct Case {
  std::string name;  ///< "" if the file has no cases
  ConfigPlace place;
  Settings settings;      ///< with a `seed` of its own it is not multiplied by the sweep's
  std::string base = {};  ///< a configuration in the place of the sweep's; "": the sweep's
};

/// Combinations that have all of these values are left out.
struct Exclusion {
  ConfigPlace place;
  Settings values;
};

/// What trials are measured on.
struct Evaluate {
  std::string benchmark;          ///< folder of the open benchmark; "": the run's own held-out data
  std::vector<std::string> sets;  ///< of the benchmark
  ConfigPlace place;
};

struct EarlyStop {
  std::string metric;           ///< "motion.pa_mpjpe": stage and held-out figure of its validation
  std::string rule = "median";  ///< or "asha"
  double after = 0.3;           ///< part of the stage's steps that every trial may do
  ConfigPlace place;

  std::string stage() const { return metric.substr(0, metric.find('.')); }
  std::string figure() const { return metric.substr(metric.find('.') + 1); }
};

struct SweepFile {
  std::string path;  ///< as the user named it
  std::string name;  ///< default: the file's name without its ending
  std::string base;  ///< the configuration, seen from the working directory
  ConfigPlace base_place;
  std::string store = "runs/store";  ///< `store=DIR`
  Settings set;                      ///< of all trials
  std::vector<Axis> axes;            ///< grid, then zip; they multiply
  std::vector<Case> cases;           ///< at least one
  std::vector<Exclusion> exclude;
  std::optional<Search> search;  ///< its points multiply with the axes
  std::vector<uint64_t> seeds;   ///< empty: the base's own
  Evaluate evaluate;
  int retries = 0;  ///< further attempts of a trial that failed
  std::optional<EarlyStop> early_stop;
};

/// Reads `path`; `arguments` are those of the command line: `key=a,b`, `key=choice(a,b)` and
/// `key=range(start,stop,step)` (stop left out) give or replace an axis, `key=value` a setting of
/// all trials. Quotes keep a comma. `seed=` and `seeds=` give the seeds, `store=` the store,
/// `base=` another configuration (seen from the working directory),
/// `evaluate.benchmark=` and `evaluate.sets=` what trials are measured on, `search.trials=` and the
/// like what is searched; `key=uniform(a,b)` and the like search a key, `key=value` fixes it.
/// InputError: one line with file and line.
SweepFile read_sweep_file(const std::string& path, const std::vector<std::string>& arguments = {});

/// InputError at `place` if this is no dotted key of a configuration.
void check_config_key(const std::string& key, const ConfigPlace& place);
/// The same value: numbers by their value, all else by text.
bool same_value(const ConfigNode& a, const ConfigNode& b);
/// The value as YAML on one line.
std::string value_text(const ConfigNode& value);

}  // namespace restage::sweep
