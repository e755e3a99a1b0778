// Configurations: reading, overriding and what is said of mistakes; schedules; and that
// docs/config_reference.md, written by hand, names every key with its true default and no other.
#include "nn/config/config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "autograd/base/nearest.h"
#include "nn/models/registry.h"
#include "tests/support/files.h"
#include "train/schedule.h"
#include "train/training/train_config.h"

namespace restage {
namespace {

enum class Space { rot6d, quaternion };
EnumNames<Space> config_names(Space) {
  return {{"rot6d", Space::rot6d}, {"quaternion", Space::quaternion}};
}
struct Layer {
  int width = 64;
  std::string kind = "linear";
  bool operator==(const Layer&) const = default;
};
struct Net {
  Space space = Space::rot6d;
  int batch = 16;
  std::optional<double> clip;
  bool operator==(const Net&) const = default;
};
struct Everything {
  std::string name = "demo";
  std::string loss = "mse";
  bool shuffle = true;
  int64_t steps = 1000;
  uint64_t seed = 0;
  double rate = 1e-4;
  float noise = 0.005f;
  double dropout = 0;
  std::vector<int64_t> milestones = {10, 20};
  std::vector<Layer> layers;
  Net net;
  bool operator==(const Everything&) const = default;
};
template <class V>
void visit(V& v, Layer& c) {
  v("width", c.width, "channels", positive());
  v("kind", c.kind, "layer | kind");
}
template <class V>
void visit(V& v, Net& c) {
  v("space", c.space, "rotation representation");
  v("batch", c.batch, "examples per step", positive());
  v("clip", c.clip, "gradient norm limit", positive());
}
template <class V>
void visit(V& v, Everything& c) {
  v("name", c.name, "run name");
  v("loss", c.loss, "loss", one_of({"mse", "huber"}));
  v("shuffle", c.shuffle, "random order");
  v("steps", c.steps, "optimiser steps", at_least(0));
  v("seed", c.seed, "random seed");
  v("rate", c.rate, "learning rate", at_least(0));
  v("noise", c.noise, "metres", between(0, 0.1));
  v("dropout", c.dropout, "probability", below(0, 1));
  v("milestones", c.milestones, "steps", positive());
  v("layers", c.layers, "layers");
  v("net", c.net, "network");
  v.check("milestones", c.milestones.size() < 4, "has more than 3 items", "remove some");
}
struct Needy {
  std::string data;
};
template <class V>
void visit(V& v, Needy& c) {
  v("data", c.data, "folder", required());
}

/// Content of a file, or overrides, and what is said of it after "x.yaml:" or "override ".
using Cases = std::vector<std::pair<std::string, std::string>>;

class ConfigFiles : public test::FileTest {
 protected:
  std::string put(const std::string& name, const std::string& text) {
    return dir.write(name, text);
  }
  /// The message for a file of this content, without the folder; "" if it is accepted.
  template <class C = Everything>
  std::string error(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return error_of<C>(put("x.yaml", text), overrides);
  }
  template <class C = Everything>
  std::string error_of(const std::string& path, const std::vector<std::string>& overrides = {}) {
    std::string what = test::refusal_of([&] {
      C config;
      load_config(path, overrides, config);
    });
    for (size_t at; (at = what.find(dir / "")) != std::string::npos;)
      what.erase(at, dir.path().size() + 1);
    return what;
  }
  /// Each file's message to the letter; `end` is what all of them end with.
  void expect_errors(const Cases& cases, const std::string& end = "") {
    for (const auto& [text, says] : cases) EXPECT_EQ(error(text), "x.yaml:" + says + end);
  }
  void expect_override_errors(const Cases& cases) {
    for (const auto& [given, says] : cases)
      EXPECT_EQ(error("layers: [{width: 1}]", {given}), "override '" + given + "': " + says);
  }
};

TEST_F(ConfigFiles, ReadsEveryType) {
  Everything c;
  const ConfigNode tree = load_config(
      put("x.yaml",
          "# comment\nname: 'a: b'\nloss: huber\nshuffle: false\nsteps: 5\nseed: "
          "18446744073709551615\n"
          "rate: 1e-3\nnoise: .01\ndropout: 0.5\nmilestones: [1, 2, 3]\nlayers:\n  - width: 3\n"
          "  - {kind: conv}\nnet:\n  space: quaternion\n  clip: 2.5\n"),
      {}, c);
  Everything want{"a: b", "huber", false, 5, ~0ull, 1e-3, .01f, .5, {1, 2, 3}, {}, {}};
  want.layers = {{3, "linear"}, {64, "conv"}};
  want.net = {Space::quaternion, 16, 2.5};
  EXPECT_EQ(c, want);
  const ConfigNode* clip = find_config(tree, "net.clip");
  ASSERT_NE(clip, nullptr);
  EXPECT_EQ(clip->place.line, 16);
  EXPECT_EQ(clip->place.column, 9);
  EXPECT_EQ(clip->key_place.column, 3);
  EXPECT_EQ(find_config(tree, "layers.1.kind")->text, "conv");
  EXPECT_EQ(find_config(tree, "layers.2.kind"), nullptr);
  EXPECT_EQ(std::string(config_error(tree, "net.clip", "is odd", "mend it").what()),
            dir / "x.yaml:16: 'net.clip' is odd; mend it");
}

TEST_F(ConfigFiles, EmptyFileAndEmptySectionKeepDefaults) {
  EXPECT_EQ(error(""), "");
  EXPECT_EQ(error("# only a comment\n"), "");
  EXPECT_EQ(error("net:\n"), "");
  Everything c;
  load_config(put("x.yaml", "net:\nname: y\n"), {}, c);
  EXPECT_EQ(c.net, Net{});
  c.net.clip = 1.0;
  load_config(put("x.yaml", "net: {clip: none}\n"), {}, c);
  EXPECT_FALSE(c.net.clip.has_value());
}

TEST_F(ConfigFiles, TypeErrorsNameFileLineKeyAndValue) {
  const std::string steps = "1: 'steps' must be a whole number >= 0, got ";
  expect_errors(
      {{"net:\n  batch: abc\n", "2: 'net.batch' must be a whole number > 0, got 'abc'"},
       {"net: {batch: 0}", "1: 'net.batch' must be a whole number > 0, got '0'"},
       {"net: {batch: 3000000000}",
        "1: 'net.batch' must be a whole number > 0 and <= 2147483647, got '3000000000'"},
       {"steps: -1", steps + "'-1'"},
       {"steps: 1.5", steps + "'1.5'"},
       {"steps: '5'", steps + "the text '5'"},
       {"steps: 99999999999999999999", steps + "'99999999999999999999'"},
       {"steps:\nname: x", steps + "nothing"},
       {"seed: -1", "1: 'seed' must be a whole number >= 0, got '-1'"},
       {"rate: fast", "1: 'rate' must be a number >= 0, got 'fast'"},
       {"noise: 1", "1: 'noise' must be a number from 0 to 0.1, got '1'"},
       {"dropout: 1", "1: 'dropout' must be a number >= 0 and < 1, got '1'"},
       {"shuffle: yes", "1: 'shuffle' must be true or false, got 'yes'"},
       {"name: [a]", "1: 'name' must be text, got a list"},
       {"name: {a: b}", "1: 'name' must be text, got a section"},
       {"net: 3", "1: 'net' must be a section of 'key: value' lines, got '3'"},
       {"milestones: 3", "1: 'milestones' must be a list such as [a, b], got '3'"},
       {"milestones:\n  - 3\n  - x\n", "3: 'milestones.1' must be a whole number > 0, got 'x'"},
       {"layers:\n  - width: 1\n  - width: 0\n",
        "3: 'layers.1.width' must be a whole number > 0, got '0'"},
       {"loss: l1", "1: 'loss' must be one of mse, huber, got 'l1'"}},
      "; correct the value");
  for (const char* bad : {"nan", "inf", ".inf", "1e999", "0x10", "1 2", "1,5"})
    EXPECT_NE(error("rate: " + std::string(bad)), "") << bad;
  expect_errors(
      {{"milestones: [1, 2, 3, 4]", "1: 'milestones' has more than 3 items; remove some"}});
}

TEST_F(ConfigFiles, ChoicesAndUnknownKeysSuggestTheNearest) {
  expect_errors(
      {{"net:\n  space: quaternions",
        "2: 'net.space' must be one of rot6d, quaternion, got 'quaternions'; did you mean "
        "'quaternion'?"},
       {"name: x\nnet:\n  bacth: 3\n", "3: unknown key 'net.bacth'; did you mean 'batch'?"},
       {"Steps: 3\n", "1: unknown key 'Steps'; did you mean 'steps'?"},
       {"net: {zzzzz: 3}\n", "1: unknown key 'net.zzzzz'; the keys here are space, batch, clip"},
       {"layers: [{wdth: 3}]", "1: unknown key 'layers.0.wdth'; did you mean 'width'?"}});
  EXPECT_EQ(error("a\x01: 3\n").find('\x01'), std::string::npos);
  EXPECT_EQ(error(std::string(300, 'k') + ": 3\n").substr(0, 30), "x.yaml:1: unknown key 'kkkkkkk");
  EXPECT_EQ(error<Needy>("dta: x"), "x.yaml:1: unknown key 'dta'; did you mean 'data'?");
  EXPECT_EQ(error<Needy>("\n"), "x.yaml:1: the key 'data' is missing; add it");
  EXPECT_EQ(nearest("batch_size", {"batch", "steps"}), "");
  EXPECT_EQ(nearest("batch-siez", {"batch", "batch_size"}), "batch_size");
  EXPECT_EQ(nearest("x", {"y"}), "");
  EXPECT_EQ(nearest("--sorce", {"--force", "--source"}), "--source");
}

TEST_F(ConfigFiles, BrokenYaml) {
  const std::string no_lines = "1: holds no 'key: value' lines; give a configuration file";
  const std::string open =
      "1: a bracket is open, or a list or section stands as a key; write 'key: value'";
  expect_errors(
      {{"just text", no_lines},
       {"- a\n", no_lines},
       {"name: a\nsteps: 1\nname: b\n",
        "3: the key 'name' stands here a second time (first in line 1); keep one of the "
        "two"},
       {"name: !!str a", "1: the tag 'tag:yaml.org,2002:str' is not supported; remove it"},
       {"a: &a {batch: 1}\nnet:\n  <<: *a\n",
        "3: merge keys ('<<') are not supported; use 'include: file.yaml'"},
       {"? [a]\n: b\n", open},
       {"? ~\n: b\n", open},
       {"net: &n\n  batch: *n\n", "2: an alias lies inside its own anchor; remove the alias"}});
  EXPECT_EQ(error("name: [a\nsteps: 3\n").substr(0, 9), "x.yaml:2:");
  EXPECT_HAS(error("name: [a\n"), "is not YAML (");
  EXPECT_EQ(error("name: a\n---\nname: b\n").substr(0, 42),
            "x.yaml:2: a second YAML document starts he");
  EXPECT_NE(error("net: *missing\n"), "");
}

TEST_F(ConfigFiles, AliasesAreAllowedButBounded) {
  Everything c;
  load_config(put("x.yaml", "layers: [&l {width: 7}, *l, *l]\n"), {}, c);
  EXPECT_EQ(c.layers, (std::vector<Layer>{{7, "linear"}, {7, "linear"}, {7, "linear"}}));
  std::string bomb = "l0: &l0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 20; ++i) {
    const std::string last = "*l" + std::to_string(i - 1);
    bomb += "l" + std::to_string(i) + ": &l" + std::to_string(i) + " [" + last;
    for (int j = 0; j < 9; ++j) bomb += ", " + last;
    bomb += "]\n";
  }
  EXPECT_HAS(error(bomb), "more than 100000 values, aliases expanded");
  EXPECT_EQ(error("name: " + std::string(100, '[') + std::string(100, ']') + "\n"),
            "x.yaml:1: nested deeper than 32; flatten the file");
  EXPECT_EQ(error("name: \"a\\\nb\"\n").find('\n'), std::string::npos);
  std::string keys;
  for (int i = 0; i < 60'000; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_EQ(error(keys),
            "x.yaml:1001: more than 1000 keys in one section; give a configuration file");
  EXPECT_NE(error(std::string(kConfigMaxBytes + 1, '#')), "");
  EXPECT_NE(error(std::string(900'000, '[')), "");
}

TEST_F(ConfigFiles, IncludesMergeAndTheFileItselfWins) {
  put("sub/base.yaml", "include: deep.yaml\nname: base\nsteps: 1\nnet:\n  batch: 2\n");
  put("sub/deep.yaml",
      "name: deep\nseed: 9\nnet: {space: quaternion, batch: 1}\nmilestones: [1, 2, 3]\n");
  put("second.yaml", "steps: 2\n");
  Everything c;
  const auto tree = load_config(
      put("x.yaml", "net: {clip: 3}\ninclude: [sub/base.yaml, second.yaml]\nmilestones: [7]\n"), {},
      c);
  Everything want;
  want.name = "base";
  want.steps = 2;
  want.seed = 9;
  want.milestones = {7};
  want.net = {Space::quaternion, 2, 3.0};
  EXPECT_EQ(c, want);
  EXPECT_EQ(find_config(tree, "net.space")->place.text(), dir / "sub/deep.yaml:3");
  // {} empties a section, nothing behind its name does nothing, and so does a file that only
  // includes
  Everything emptied;
  load_config(put("y.yaml", "include: x.yaml\nnet: {}\n"), {}, emptied);
  EXPECT_EQ(emptied.net, Net());
  for (const char* text : {"include: x.yaml\n", "include: x.yaml\nnet:\n"}) {
    Everything same;
    load_config(put("y.yaml", text), {}, same);
    EXPECT_EQ(same, want);
  }
  // an error in an included file names that file
  put("sub/deep.yaml", "\nnmae: deep\n");
  EXPECT_EQ(error_of(dir / "x.yaml"), "sub/deep.yaml:2: unknown key 'nmae'; did you mean 'name'?");
}

TEST_F(ConfigFiles, IncludeErrors) {
  EXPECT_EQ(error("name: a\ninclude: none.yaml\n"),
            "x.yaml:2: the included file 'none.yaml' does not exist; give a path relative to the "
            "file that "
            "includes it");
  EXPECT_EQ(error("include: x.yaml\n"),
            "x.yaml:1: including 'x.yaml' here makes a circle; remove one of the includes");
  put("sub/b.yaml", "\ninclude: ../sub/../x.yaml\n");
  EXPECT_EQ(
      error("include: sub/b.yaml\n"),
      "sub/b.yaml:2: including '../sub/../x.yaml' here makes a circle; remove one of the includes");
  EXPECT_EQ(error("include: {a: b}\n"),
            "x.yaml:1: 'include' must be a file or a list of files; write 'include: other.yaml'");
  EXPECT_EQ(error("net:\n  include: sub/b.yaml\n"),
            "x.yaml:2: unknown key 'net.include'; the keys here are space, batch, clip");
  EXPECT_HAS(error("include: sub\n"), "is a folder");
  EXPECT_EQ(error("include: ${oc.env:RESTAGE_NO_SUCH,none}.yaml\n"),
            "x.yaml:1: the included file 'none.yaml' does not exist; give a path relative to the "
            "file that includes it");
  EXPECT_EQ(error("include: ${oc.env:RESTAGE_NO_SUCH}.yaml\n"),
            "x.yaml:1: the environment has no variable 'RESTAGE_NO_SUCH'; set it, or write "
            "${oc.env:NAME,DEFAULT}");
  EXPECT_EQ(error("steps: ${oc.env:RESTAGE_NO_SUCH,${HOME}}\n"),
            "x.yaml:1: the default of the variable 'RESTAGE_NO_SUCH' holds '${HOME', and a "
            "reference in a reference is not looked up; write a value without ${");
  // the same file twice is no circle, but files cannot multiply without end
  put("leaf.yaml", "steps: 3\n");
  EXPECT_EQ(error("include: [leaf.yaml, leaf.yaml]\n"), "");
  for (int i = 0; i < 10; ++i) {
    const std::string next = i == 0 ? "leaf.yaml" : "m" + std::to_string(i - 1) + ".yaml";
    put("m" + std::to_string(i) + ".yaml", "include: [" + next + ", " + next + "]\n");
  }
  EXPECT_HAS(error("include: m9.yaml\n"), "more than 64 files are included");
  EXPECT_NE(error_of(dir / "absent.yaml"), "");
}

TEST_F(ConfigFiles, OverridesWinAndErrorsNameThem) {
  Everything c;
  load_config(put("x.yaml", "steps: 1\nlayers: [{width: 1}]\n"),
              {"steps=2", "net.batch=3", "milestones=[4, 5]", "net={clip: 1}", "layers.0.kind=conv",
               "name=a=b", "steps=7"},
              c);
  EXPECT_EQ(c.steps, 7);
  EXPECT_EQ(c.net, (Net{Space::rot6d, 3, 1.0}));
  EXPECT_EQ(c.milestones, (std::vector<int64_t>{4, 5}));
  EXPECT_EQ(c.layers, (std::vector<Layer>{{1, "conv"}}));
  EXPECT_EQ(c.name, "a=b");
  const std::string steps = "'steps' must be a whole number >= 0, got ";
  expect_override_errors(
      {{"net.batch=abc", "'net.batch' must be a whole number > 0, got 'abc'; correct the value"},
       {"net.bacth=1", "unknown key 'net.bacth'; did you mean 'batch'?"},
       {"steps.x=1", steps + "a section; correct the value"},
       {"steps=", steps + "nothing; correct the value"},
       {"layers.1.width=1", "the list has no item '1'; give a number from 0 to 0"}});
  EXPECT_EQ(error("steps: 3", {"steps.x=1"}),
            "override 'steps.x=1': " + steps + "a section; correct the value");
  EXPECT_EQ(error("", {"name=[a"}).substr(0, 37), "override 'name=[a': a bracket is open");
  for (const char* bad : {"steps", "=3", "a..b=1", ".a=1", "a b=1", "a\nb=1"})
    EXPECT_HAS(error("", {bad}), "is no override; write key=value or key.sub=value") << bad;
  EXPECT_HAS(error("", {"include=x.yaml"}), "unknown key 'include'");
}

TEST_F(ConfigFiles, ResolvedYamlReadsBackToTheSame) {
  Everything c;
  c.name = "it's \"odd\"\n\ttab: # \\ null";
  c.rate = 0.1 + 0.2;
  c.noise = 1.0f / 30;
  c.seed = ~0ull;
  c.layers = {{1, "null"}, {2, ""}, {3, "none"}, {4, "true"}, {5, "1e5"}, {6, "\u00e9-x"}};
  c.milestones = {};
  c.net.clip = 1e-300;
  const std::string text = resolved_yaml(c);
  Everything back;
  load_config(put("x.yaml", text), {}, back);
  EXPECT_EQ(back, c) << text;
  EXPECT_EQ(resolved_yaml(back), text);
  c.net.clip.reset();
  c.layers.clear();
  Everything other;
  other.net.clip = 4;
  load_config(put("x.yaml", resolved_yaml(c)), {}, other);
  EXPECT_EQ(other, c);
  EXPECT_EQ(resolved_yaml(Net{}), "space: rot6d\nbatch: 16\nclip: null\n");
  EXPECT_EQ(config_to_yaml(parse_yaml("a: {b: [1, [2]], c: [{d: 1, e: []}, {}]}\nf: {}\n", "")),
            "a:\n  b: [1, [2]]\n  c:\n    - d: 1\n      e: []\n    - {}\nf: {}\n");
}

TEST_F(ConfigFiles, Tf32IsForGpus) {
  using Training = restage::TrainConfig;
  EXPECT_HAS(error<Training>("precision: tf32\n"), "tf32, which only GPUs have; give float32");
  EXPECT_EQ(error<Training>("precision: tf32\ndevice: cuda\n"), "");
}

TEST_F(ConfigFiles, ReferenceListsEveryKey) {
  const std::string table = config_reference_table(config_reference<Everything>());
  for (const char* line :
       {"| `steps` | whole number >= 0 | `1000` | optimiser steps |",
        "| `loss` | one of mse, huber | `mse` | loss |",
        "| `milestones` | list of whole number > 0 | `[10, 20]` | steps |",
        "| `net.space` | one of rot6d, quaternion | `rot6d` | rotation representation |",
        "| `net.clip` | none or number > 0 | `none` | gradient norm limit |",
        "| `layers` | list of section | `[]` | layers |",
        "| `layers[].kind` | text | `linear` | layer \\| kind |",
        "| `net` | section |  | network |"})
    EXPECT_HAS(table, line) << line << "\n" << table;
  EXPECT_HAS(config_reference_table(config_reference<Needy>()), "| `data` | text | `(required)` |");
}

// ---- schedules

ScheduleConfig from(const std::string& yaml) {
  ScheduleConfig config;
  read_config(parse_yaml(yaml, "x.yaml"), config);
  return config;
}

TEST(TrainSchedule, Constant) {
  const auto c = from("rate: 3e-4");
  for (const int64_t step : {0, 1, 500, 100000}) EXPECT_EQ(learning_rate(c, step, 1000), 3e-4);
}

TEST(TrainSchedule, MilestonesDropAtTheStepItself) {
  const auto c = from("{rate: 1e-4, kind: milestones, milestones: [30, 32], factor: 0.1}");
  for (const auto& [step, rate] : {std::pair{0, 1e-4},
                                   {29, 1e-4},
                                   {30, 1e-4 * 0.1},
                                   {31, 1e-4 * 0.1},
                                   {32, 1e-4 * 0.1 * 0.1},
                                   {1000, 1e-4 * 0.1 * 0.1}})
    EXPECT_EQ(learning_rate(c, step, 34), rate) << step;
}

TEST(TrainSchedule, CosineWithWarmup) {
  const auto c = from("{rate: 2.0, kind: cosine, warmup: 4, final_fraction: 0.25}");
  for (const auto& [step, rate] : {std::pair{0, 0.5},
                                   {1, 1.0},
                                   {3, 2.0},
                                   {4, 2.0},
                                   {54, 2.0 * (0.25 + 0.75 * 0.5)},
                                   {104, 0.5},
                                   {1000, 0.5}})
    EXPECT_DOUBLE_EQ(learning_rate(c, step, 105), rate) << step;
  for (int64_t step = 5; step < 105; ++step)
    EXPECT_LT(learning_rate(c, step, 105), learning_rate(c, step - 1, 105));
  EXPECT_DOUBLE_EQ(learning_rate(c, 0, 0), 0.5);  // degenerate lengths are no division by zero
  EXPECT_DOUBLE_EQ(learning_rate(from("{rate: 1, kind: cosine}"), 0, 1), 1.0);
}

TEST(TrainSchedule, BadConfigs) {
  const std::pair<const char*, const char*> cases[] = {
      {"kind: milestones\nmilestones: [3, 3]",
       "x.yaml:2: 'milestones' must increase; sort the steps, each once"},
      {"milestones: [3]",
       "x.yaml:1: 'milestones' is only for 'kind: milestones'; set that kind or remove the list"},
      {"kind: cosin",
       "x.yaml:1: 'kind' must be one of constant, milestones, cosine, linear, polynomial, "
       "exponential, "
       "restarts, one_cycle, got 'cosin'; did you mean "
       "'cosine'?"}};
  for (const auto& [yaml, says] : cases)
    EXPECT_EQ(test::error_of([&, text = yaml] { from(text); }), says);
  EXPECT_THROW(from("final_fraction: 1.5"), InputError);
}

/// Key as the page has it: what several stages share stands there once, without the stage.
std::string on_the_page(const std::string& key) {
  std::string out = std::regex_replace(key, std::regex("^\\w+\\.discriminator_adam\\."), "adam.");
  for (const char* shared : {".optimiser.", ".sizes."})
    if (const size_t at = out.find(shared); at != std::string::npos)
      out = out.substr(at + std::string(shared).size());
  return out;
}

bool same_value(const std::string& a, const std::string& b) {
  char *end_a = nullptr, *end_b = nullptr;
  const double x = std::strtod(a.c_str(), &end_a), y = std::strtod(b.c_str(), &end_b);
  const bool numbers = end_a != a.c_str() && end_b != b.c_str() && *end_a == 0 && *end_b == 0;
  return numbers ? x == y : a == b;
}

TEST(ConfigReferencePage, NamesEveryKeyWithItsDefault) {
  std::ifstream file(RESTAGE_SOURCE_DIR "/docs/config_reference.md");
  ASSERT_TRUE(file) << "docs/config_reference.md is missing";
  const std::regex row("^\\| `([^`]+)` \\| [^|]+ \\| `?([^|`]*)`? \\|.*");
  std::multimap<std::string, std::string> page;
  std::smatch found;
  for (std::string line; std::getline(file, line);)
    if (std::regex_match(line, found, row)) page.emplace(found[1], found[2]);

  std::set<std::string> keys;
  for (const ConfigReference::Row& wanted : config_reference<restage::TrainConfig>()) {
    const std::string key = page.contains(wanted.key) ? wanted.key : on_the_page(wanted.key);
    keys.insert(key);
    if (wanted.type == "section" && page.count(key) == 0 && key != wanted.key) continue;
    EXPECT_EQ(page.count(key), 1u) << wanted.key;
    for (auto [at, end] = page.equal_range(key); at != end; ++at)
      EXPECT_TRUE(same_value(at->second, wanted.value))
          << wanted.key << ": the page says '" << at->second << "', the code '" << wanted.value
          << "'";
  }
  for (const auto& [key, value] : page) EXPECT_TRUE(keys.contains(key)) << key << " is no key";
}

TEST(ConfigOfARun, OfAnEarlierVersionIsRead) {
  const std::string left =
      "stages: [motion]\nseed: 9\nroot: {points: 7, model: deformation/root}\n";
  const auto read = [](const ConfigNode& tree) {
    restage::TrainConfig c;
    read_config(tree, c);
    return c.seed;
  };
  EXPECT_EQ(read(of_this_version(parse_yaml(left, "run/config.yaml"))), 9u);
  // Nobody else may name a stage that is no more: not a user, nor a run that trained it.
  EXPECT_HAS(test::refusal_of([&] { read(parse_yaml(left, "mine.yaml")); }), "mine.yaml:3");
  EXPECT_HAS(test::refusal_of([&] { read(parse_yaml("stages: [root]\n", "mine.yaml")); }),
             "'root'");
  EXPECT_HAS(test::refusal_of([&] {
               read(of_this_version(
                   parse_yaml(test::replaced(left, "motion", "root"), "run/config.yaml")));
             }),
             "root");
}

/// The page's line of a model that no stage has by default.
TEST(ConfigReferencePage, NamesTheSizesOfEveryModel) {
  std::ifstream file(RESTAGE_SOURCE_DIR "/docs/config_reference.md");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  const std::set<std::string> by_default = {
      "skeleton/point_transformer", "smrm/rot6d",   "deformation/weights",
      "deformation/offsets",        "transfer/npt", "codes/h4d"};
  for (const ModelType& type : models()) {
    std::vector<ConfigReference::Row> rows;
    ConfigReference reference(rows);
    AnyConfig sizes = type.config;
    sizes.visit_held(reference);
    if (by_default.contains(type.name) || type.role == "discriminator" ||
        type.role == "deformation.root" || !type.module.empty() || rows.empty())
      continue;
    const auto line = std::find_if(lines.begin(), lines.end(), [&](const std::string& text) {
      return text.starts_with("| ") && text.find(type.name) < text.find("|", 2);
    });
    ASSERT_NE(line, lines.end()) << type.name;
    if (line->find("those of ") != std::string::npos) continue;
    for (const ConfigReference::Row& row : rows)
      EXPECT_NE(line->find(row.key + " " + row.value), std::string::npos)
          << type.name << ": " << row.key << " " << row.value;
  }
}

}  // namespace
}  // namespace restage
