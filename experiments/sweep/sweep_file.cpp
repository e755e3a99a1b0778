#include "experiments/sweep/sweep_file.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <functional>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "experiments/shipped_config.h"
#include "experiments/sweep/sweep_words.h"
#include "nn/config/config.h"
#include "nn/config/config_reader.h"

namespace restage::sweep {
namespace {

namespace fs = std::filesystem;
using Kind = ConfigNode::Kind;

const std::vector<std::string> kKeys = {"name",    "base",       "set",     "grid",  "zip",
                                        "cases",   "search",     "exclude", "seeds", "evaluate",
                                        "retries", "early_stop", "python"};

[[noreturn]] void fail(const ConfigPlace& place, const std::string& wrong, const std::string& fix) {
  throw InputError(place.text(), wrong, fix);
}

void need(const ConfigNode& node, Kind kind, const std::string& what) {
  if (node.kind != kind)
    fail(node.place, in_quotes(node.key) + " must be " + what, "correct the value");
}

/// Only these keys.
void check_keys(const ConfigNode& map, const std::vector<std::string>& known) {
  for (const ConfigNode& entry : map.children) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    const std::string close = nearest(entry.key, known);
    fail(entry.key_place, "unknown key " + in_quotes(entry.key),
         close.empty() ? "the keys here are " + joined(known)
                       : "did you mean " + in_quotes(close) + "?");
  }
}

/// Every value below `node` with its dotted key; sections are opened.
void flatten(const ConfigNode& node, const std::string& prefix, Settings& out) {
  for (const ConfigNode& entry : node.children) {
    const std::string key = prefix + entry.key;
    if (entry.kind == Kind::map && !entry.children.empty()) {
      flatten(entry, key + ".", out);
      continue;
    }
    check_config_key(key, entry.key_place);
    for (const Setting& other : out)
      if (other.key == key)
        fail(entry.key_place,
             in_quotes(key) + " stands here a second time (first in line " +
                 std::to_string(other.value.key_place.line) + ")",
             "keep one of the two");
    out.push_back({key, entry});
  }
}

void check_no_seed(const std::string& key, const ConfigPlace& place) {
  if (key == "seed")
    fail(place, "'seed' stands among the keys", "write 'seeds: [1, 2]' in the sweep file");
}

/// `seed`: one may be among them.
Settings settings_of(const ConfigNode& map, const std::string& what, bool seed = false) {
  need(map, Kind::map, what);
  Settings out;
  flatten(map, "", out);
  for (const Setting& setting : out)
    if (!seed) check_no_seed(setting.key, setting.value.key_place);
  return out;
}

/// Keys with lists that move together. All lists are of one length.
Axis axis_of(const Settings& lists) {
  Axis axis;
  for (const Setting& list : lists) {
    if (list.value.kind != Kind::list || list.value.children.empty())
      fail(list.value.place, in_quotes(list.key) + " must be a list of values",
           "write [a, b]; a value for all trials belongs into 'set'");
    const size_t n = list.value.children.size();
    if (axis.keys.empty()) axis.points.resize(n);
    if (n != axis.points.size())
      fail(list.value.place,
           in_quotes(list.key) + " has " + std::to_string(n) + " values, but " +
               in_quotes(axis.keys[0]) + " beside it has " + std::to_string(axis.points.size()),
           "give lists of equal length");
    axis.keys.push_back(list.key);
    for (size_t i = 0; i < n; ++i) axis.points[i].push_back({list.key, list.value.children[i]});
  }
  return axis;
}

/// A list item has no key of its own; errors about it should still know both places.
void name_points(Axis& axis) {
  for (Settings& point : axis.points)
    for (Setting& setting : point) setting.value.key_place = setting.value.place;
}

Evaluate evaluate_of(const ConfigNode& node) {
  need(node, Kind::map, "a section such as {benchmark: FOLDER, sets: [naked]}");
  check_keys(node, {"benchmark", "sets"});
  Evaluate out;
  out.place = node.key_place;
  const ConfigNode* folder = node.find("benchmark");
  const ConfigNode* sets = node.find("sets");
  if (folder == nullptr || sets == nullptr)
    fail(node.key_place, "'evaluate' needs both 'benchmark' and 'sets'",
         "write {benchmark: FOLDER, sets: [naked, clothed]}, or leave it out");
  need(*folder, Kind::scalar, "the folder of the benchmark");
  out.benchmark = folder->text;
  need(*sets, Kind::list, "a list of sets such as [naked, clothed]");
  if (sets->children.empty()) fail(sets->place, "'sets' is empty", "name one set at least");
  for (const ConfigNode& item : sets->children) {
    if (item.kind != Kind::scalar) fail(item.place, "a set is named by a word", "write [naked]");
    if (std::find(out.sets.begin(), out.sets.end(), item.text) != out.sets.end())
      fail(item.place, "the set " + in_quotes(item.text) + " stands here twice", "keep one");
    out.sets.push_back(item.text);
  }
  return out;
}

template <class T>
T number_of(const ConfigNode& node, const std::string& name, const Rule& rule) {
  T value{};
  config_detail::read_leaf(node, name, rule, value);
  return value;
}

std::vector<uint64_t> seeds_of(const ConfigNode& node) {
  ConfigNode list = node;
  if (node.kind == Kind::scalar) {
    list.kind = Kind::list;
    list.children = {node};
  }
  if (list.kind != Kind::list || list.children.empty())
    fail(node.place, "'seeds' must be a list of numbers", "write seeds: [1, 2, 3]");
  std::vector<uint64_t> out;
  for (const ConfigNode& item : list.children) {
    const auto seed = number_of<uint64_t>(item, "seeds", {});
    if (std::find(out.begin(), out.end(), seed) != out.end())
      fail(item.place, "the seed " + std::to_string(seed) + " stands here twice", "keep one");
    out.push_back(seed);
  }
  return out;
}

EarlyStop early_stop_of(const ConfigNode& node) {
  need(node, Kind::map, "a section such as {metric: motion.pa_mpjpe, rule: median, after: 0.3}");
  check_keys(node, {"metric", "rule", "after"});
  EarlyStop out;
  out.place = node.key_place;
  const ConfigNode* metric = node.find("metric");
  if (metric == nullptr) fail(node.key_place, "'early_stop' needs a 'metric'", "add it");
  out.metric = number_of<std::string>(*metric, "early_stop.metric", {});
  if (const ConfigNode* rule = node.find("rule"))
    out.rule = number_of<std::string>(*rule, "early_stop.rule", one_of({"median", "asha"}));
  if (const ConfigNode* after = node.find("after"))
    out.after = number_of<double>(*after, "early_stop.after", between(0, 1));
  return out;
}

/// The file alone, without what the command line adds.
class SweepReader {
 public:
  explicit SweepReader(const std::string& path)
      : tree_(parse_yaml(read_file(path, kConfigMaxBytes), path)) {
    out_.path = path;
    check_keys(tree_, kKeys);
  }

  SweepFile read() {
    read_base();
    if (const auto* node = tree_.find("set"))
      out_.set = settings_of(*node, "a section of 'key: value' lines");
    if (const auto* node = tree_.find("python")) read_python(*node);
    read_axes();
    read_cases();
    if (const auto* node = tree_.find("exclude")) {
      need(*node, Kind::list, "a list of sections such as [{key: value}]");
      for (const ConfigNode& item : node->children) {
        Exclusion exclusion{item.place, settings_of(item, "a section {key: value}")};
        if (exclusion.values.empty()) fail(item.place, "would leave out everything", "name a key");
        out_.exclude.push_back(std::move(exclusion));
      }
    }
    if (const auto* node = tree_.find("search")) out_.search = search_of(*node);
    if (const auto* node = tree_.find("seeds")) out_.seeds = seeds_of(*node);
    if (const auto* node = tree_.find("evaluate")) out_.evaluate = evaluate_of(*node);
    if (const auto* node = tree_.find("retries"))
      out_.retries = number_of<int>(*node, "retries", between(0, 1000));
    if (const auto* node = tree_.find("early_stop")) out_.early_stop = early_stop_of(*node);
    return std::move(out_);
  }

 private:
  void read_base() {
    out_.name = fs::path(out_.path).stem().string();
    if (const auto* node = tree_.find("name")) {
      out_.name = number_of<std::string>(*node, "name", {});
      if (out_.name.empty()) fail(node->place, "'name' is empty", "give a word, or leave it out");
    }
    const ConfigNode* base = tree_.find("base");
    if (base == nullptr)
      fail(tree_.place, "the key 'base' is missing", "name the configuration to vary");
    out_.base_place = base->place;
    out_.base = base_of(*base);
  }

  /// The file of a configuration, seen from the working directory.
  std::string base_of(const ConfigNode& base) const {
    need(base, Kind::scalar, "the file of a training configuration");
    std::string out = (fs::path(out_.path).parent_path() / base.text).lexically_normal().string();
    std::error_code ignored;
    if (fs::is_regular_file(out, ignored)) return out;
    out = shipped_config(base.text);
    if (out.empty())
      fail(base.place, "the base " + in_quotes(base.text) + " is no file",
           "give a path relative to the sweep file, or the name of a configuration that comes with "
           "the program");
    return out;
  }

  /// Files that lie beside the sweep's become a setting of all trials.
  void read_python(ConfigNode files) {
    need(files, Kind::list, "a list of files such as [mine.py]");
    for (ConfigNode& file : files.children) file.text = seen_from(out_.path, file.text);
    for (const Setting& setting : out_.set)
      if (setting.key == "python")
        fail(files.key_place, "'python' stands here and in 'set'", "keep one of the two");
    out_.set.push_back({"python", std::move(files)});
  }

  void read_axes() {
    if (const auto* node = tree_.find("grid"))
      for (Setting& list : settings_of(*node, "a section of 'key: [values]' lines"))
        add_axis({std::move(list)});
    const ConfigNode* node = tree_.find("zip");
    if (node == nullptr) return;
    need(*node, Kind::list, "a list of sections such as [{a: [1, 2], b: [3, 4]}]");
    for (const ConfigNode& item : node->children) {
      Settings lists = settings_of(item, "a section {key: [values]}");
      if (lists.empty()) fail(item.place, "moves nothing", "name keys with lists");
      add_axis(lists);
    }
  }

  void add_axis(const Settings& lists) {
    for (const Setting& list : lists) {
      const ConfigPlace& place = list.value.key_place;
      for (const Setting& setting : out_.set)
        if (setting.key == list.key) fail_twice(list.key, place, setting.value.key_place);
      for (const Axis& axis : out_.axes)
        for (const Setting& first : axis.points[0])
          if (first.key == list.key) fail_twice(list.key, place, first.value.place);
    }
    out_.axes.push_back(axis_of(lists));
    name_points(out_.axes.back());
  }

  void read_cases() {
    const ConfigNode* node = tree_.find("cases");
    if (node == nullptr) {
      out_.cases.push_back({"", tree_.place, {}});
      return;
    }
    need(*node, Kind::map, "a section of 'name: {key: value}' lines");
    if (node->children.empty())
      fail(node->key_place, "'cases' is empty", "name one, or leave it out");
    for (const ConfigNode& entry : node->children) {
      Case made{entry.key, entry.key_place, {}};
      if (entry.kind != Kind::null)
        made.settings = settings_of(entry, "a section {key: value}", true);
      if (const ConfigNode* base = entry.find("base")) made.base = base_of(*base);
      std::erase_if(made.settings, [](const Setting& setting) { return setting.key == "base"; });
      for (const Setting& setting : made.settings)
        for (const Axis& axis : out_.axes)
          for (const Setting& first : axis.points[0])
            if (first.key == setting.key)
              fail_twice(setting.key, setting.value.key_place, first.value.place);
      out_.cases.push_back(std::move(made));
    }
  }

  [[noreturn]] static void fail_twice(const std::string& key, const ConfigPlace& place,
                                      const ConfigPlace& first) {
    fail(place, in_quotes(key) + " has values in line " + std::to_string(first.line) + " already",
         "keep one of the two");
  }

  ConfigNode tree_;
  SweepFile out_;
};

/// evaluate.benchmark=FOLDER, evaluate.sets=[a, b] (or a,b): each alone changes one of what the
/// file says, both together need no file that says any.
void add_evaluate(SweepFile& file, const std::vector<SweepWord>& words) {
  if (words.empty()) return;
  const ConfigPlace last{"override " + in_quotes(words.back().text), 0, 0};
  const auto leaf = [&](const std::string& key, Kind kind, const std::string& text) {
    ConfigNode node;
    node.key = key;
    node.kind = kind;
    node.text = text;
    node.place = node.key_place = last;
    return node;
  };
  ConfigNode folder = leaf("benchmark", Kind::scalar, file.evaluate.benchmark);
  ConfigNode sets = leaf("sets", Kind::list, "");
  for (const std::string& set : file.evaluate.sets)
    sets.children.push_back(leaf("", Kind::scalar, set));
  for (const SweepWord& word : words) {
    const std::string key = word.key.substr(word.key.find('.') + 1);
    if (key == "benchmark" && !word.several) {
      folder = word.values[0];
      folder.key = key;
      folder.place = folder.key_place = last;
    } else if (key == "sets") {
      const bool list = !word.several && word.values[0].kind == Kind::list;
      sets.children = list ? word.values[0].children : word.values;
      for (ConfigNode& set : sets.children) set.place = last;
    } else {
      fail({"override " + in_quotes(word.text), 0, 0}, "is nothing of 'evaluate'",
           "give evaluate.benchmark=FOLDER or evaluate.sets=a,b");
    }
  }
  if (folder.text.empty())
    fail(last, "needs the benchmark's folder too", "give evaluate.benchmark=FOLDER");
  ConfigNode node = leaf("evaluate", Kind::map, "");
  node.children = {folder, sets};
  file.evaluate = evaluate_of(node);
}

void add_search(SweepFile& file, const SweepWord& word) {
  const ConfigPlace place{"override " + in_quotes(word.text), 0, 0};
  if (!file.search)
    fail(place, "is about a search, and " + file.path + " has none", "add 'search' there");
  if (word.several) fail(place, "has several values", "give one");
  set_search_key(*file.search, word.key.substr(word.key.find('.') + 1), word.values[0], place);
}

/// The search that a range of the command line belongs to.
void add_range(SweepFile& file, const SweepWord& word) {
  const ConfigPlace place{"override " + in_quotes(word.text), 0, 0};
  check_config_key(word.key, place);
  if (!file.search) {
    file.search.emplace();
    file.search->kind = "random";
    file.search->place = file.search->metric_place = place;
  }
  search::Dimension added = range_of_word(word.key, word.range, word.values, place);
  std::erase_if(file.search->space, [&](const auto& one) { return one.key == word.key; });
  file.search->space.push_back(std::move(added));
  std::erase_if(file.set, [&](const Setting& setting) { return setting.key == word.key; });
  std::erase_if(file.axes, [&](const Axis& axis) {
    return axis.keys.size() == 1 && axis.keys[0] == word.key;
  });
}

/// Lays one argument over the file: it wins over `set` and over an axis of its own, but not over
/// what moves together with others.
void add_argument(SweepFile& file, const SweepWord& word) {
  const ConfigPlace place{"override " + in_quotes(word.text), 0, 0};
  if (word.key == "store") {
    if (word.values.size() != 1 || word.values[0].text.empty())
      fail(place, "is no folder", "write store=DIR");
    file.store = word.values[0].text;
    return;
  }
  if (word.key == "base") {
    if (word.values.size() != 1 || word.values[0].text.empty())
      fail(place, "is no file", "write base=CONFIG.yaml");
    if (std::none_of(file.cases.begin(), file.cases.end(),
                     [](const Case& one) { return one.base.empty(); }))
      fail(place, "is said by every case of " + file.path, "change it there");
    file.base = config_file(word.values[0].text);
    file.base_place = place;
    return;
  }
  if (word.key == "seed" || word.key == "seeds") {
    ConfigNode list;
    list.kind = Kind::list;
    list.place = place;
    list.children = word.values;
    if (word.values.size() == 1 && word.values[0].kind == Kind::list) list = word.values[0];
    file.seeds = seeds_of(list);
    return;
  }
  check_config_key(word.key, place);
  const auto says = [&](const Case& one) {
    return std::any_of(one.settings.begin(), one.settings.end(),
                       [&](const Setting& setting) { return setting.key == word.key; });
  };
  // As in 'set', what a case says wins; a word that no case lets through would be of no effect.
  if (std::all_of(file.cases.begin(), file.cases.end(), says))
    fail(place, "is said by every case of " + file.path, "change it there");
  if (word.several && std::any_of(file.cases.begin(), file.cases.end(), says))
    fail(place, "has values, but a case of " + file.path + " says it", "change it there");
  std::erase_if(file.set, [&](const Setting& setting) { return setting.key == word.key; });
  if (file.search) {
    std::erase_if(file.search->space, [&](const auto& one) { return one.key == word.key; });
    if (file.search->space.empty())
      fail(place, "leaves nothing to search", "use a sweep file without 'search'");
  }
  for (auto axis = file.axes.begin(); axis != file.axes.end(); ++axis) {
    if (std::find(axis->keys.begin(), axis->keys.end(), word.key) == axis->keys.end()) continue;
    if (axis->keys.size() > 1)
      fail(place, "moves together with others in " + axis->points[0][0].value.place.text(),
           "change it there");
    file.axes.erase(axis);
    break;
  }
  if (!word.several) {
    file.set.push_back({word.key, word.values[0]});
    return;
  }
  Axis axis{{word.key}, {}};
  for (const ConfigNode& value : word.values) axis.points.push_back({{word.key, value}});
  file.axes.push_back(std::move(axis));
}

bool as_number(const ConfigNode& node, double& value) {
  if (node.kind != Kind::scalar || node.quoted) return false;
  const char* end = node.text.data() + node.text.size();
  const auto found = std::from_chars(node.text.data(), end, value);
  return found.ec == std::errc() && found.ptr == end;
}

}  // namespace

SweepFile read_sweep_file(const std::string& path, const std::vector<std::string>& arguments) {
  SweepFile file = SweepReader(path).read();
  std::set<std::string> seen;
  std::vector<SweepWord> evaluate, search;
  for (const std::string& argument : arguments) {
    const SweepWord word = read_sweep_word(argument);
    if (!seen.insert(word.key).second)
      fail({"override " + in_quotes(argument), 0, 0}, "gives the key a second time", "keep one");
    if (word.key.starts_with("evaluate."))
      evaluate.push_back(word);
    else if (word.key.starts_with("search."))
      search.push_back(word);
    else if (!word.range.empty())
      add_range(file, word);
    else
      add_argument(file, word);
  }
  add_evaluate(file, evaluate);
  // What other keys may be is said by the kind.
  std::stable_partition(search.begin(), search.end(),
                        [](const SweepWord& word) { return word.key == "search.kind"; });
  for (const SweepWord& word : search) add_search(file, word);
  if (file.search) check_search(file);
  return file;
}

void check_config_key(const std::string& key, const ConfigPlace& place) {
  bool good = !key.empty() && key.front() != '.' && key.back() != '.' &&
              key.find("..") == std::string::npos;
  for (const char c : key)
    good = good &&
           (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '-');
  if (!good) fail(place, in_quotes(key) + " is no key of a configuration", "write section.key");
}

bool same_value(const ConfigNode& a, const ConfigNode& b) {
  double x = 0, y = 0;
  if (as_number(a, x) && as_number(b, y)) return x == y;
  if (a.kind != b.kind || a.children.size() != b.children.size()) return false;
  for (size_t i = 0; i < a.children.size(); ++i)
    if (a.children[i].key != b.children[i].key || !same_value(a.children[i], b.children[i]))
      return false;
  return a.text == b.text;
}

std::string value_text(const ConfigNode& value) {
  ConfigNode list;  // the writer's one-line form is that of lists
  list.kind = Kind::list;
  list.children = {value};
  const std::string text = config_to_yaml(list);  // "[value]\n"
  return text.substr(1, text.size() - 3);
}

}  // namespace restage::sweep
