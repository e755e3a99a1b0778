#include "nn/config/config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "autograd/base/nearest.h"
#include "autograd/base/rng.h"

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

class TrainConfig : public testing::Test {
 protected:
  void SetUp() override {
    folder = testing::TempDir() + "restage_config_" + std::to_string(::getpid());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder + "/sub");
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  std::string put(const std::string& name, const std::string& text) {
    std::ofstream(folder + "/" + name, std::ios::binary) << text;
    return folder + "/" + name;
  }
  /// The message for a file of this content, without the folder; "" if it is accepted.
  template <class C = Everything>
  std::string error(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return error_of<C>(put("x.yaml", text), overrides);
  }
  template <class C = Everything>
  std::string error_of(const std::string& path, const std::vector<std::string>& overrides = {}) {
    try {
      C config;
      load_config(path, overrides, config);
    } catch (const InputError& e) {
      std::string what = e.what();
      EXPECT_LT(what.size(), 400u) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
      EXPECT_NE(what.find("; "), std::string::npos) << what;
      for (size_t at; (at = what.find(folder + "/")) != std::string::npos;)
        what.erase(at, folder.size() + 1);
      return what;
    }
    return "";
  }
  std::string folder;
};

TEST_F(TrainConfig, ReadsEveryType) {
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
            folder + "/x.yaml:16: 'net.clip' is odd; mend it");
}

TEST_F(TrainConfig, EmptyFileAndEmptySectionKeepDefaults) {
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

TEST_F(TrainConfig, TypeErrorsNameFileLineKeyAndValue) {
  EXPECT_EQ(error("net:\n  batch: abc\n"),
            "x.yaml:2: 'net.batch' must be a whole number > 0, got 'abc'; correct the value");
  EXPECT_EQ(error("net: {batch: 0}"),
            "x.yaml:1: 'net.batch' must be a whole number > 0, got '0'; correct the value");
  EXPECT_EQ(error("net: {batch: 3000000000}"),
            "x.yaml:1: 'net.batch' must be a whole number > 0 and <= 2147483647, got '3000000000'; "
            "correct the value");
  EXPECT_EQ(error("steps: -1"),
            "x.yaml:1: 'steps' must be a whole number >= 0, got '-1'; correct the value");
  EXPECT_EQ(error("steps: 1.5"),
            "x.yaml:1: 'steps' must be a whole number >= 0, got '1.5'; correct the value");
  EXPECT_EQ(error("steps: '5'"),
            "x.yaml:1: 'steps' must be a whole number >= 0, got the text '5'; correct the value");
  EXPECT_EQ(error("steps: 99999999999999999999"),
            "x.yaml:1: 'steps' must be a whole number >= 0, got '99999999999999999999'; correct "
            "the value");
  EXPECT_EQ(error("steps:\nname: x"),
            "x.yaml:1: 'steps' must be a whole number >= 0, got nothing; correct the value");
  EXPECT_EQ(error("seed: -1"),
            "x.yaml:1: 'seed' must be a whole number >= 0, got '-1'; correct the value");
  EXPECT_EQ(error("rate: fast"),
            "x.yaml:1: 'rate' must be a number >= 0, got 'fast'; correct the value");
  for (const char* bad : {"nan", "inf", ".inf", "1e999", "0x10", "1 2", "1,5"})
    EXPECT_NE(error("rate: " + std::string(bad)), "") << bad;
  EXPECT_EQ(error("noise: 1"),
            "x.yaml:1: 'noise' must be a number from 0 to 0.1, got '1'; correct the value");
  EXPECT_EQ(error("dropout: 1"),
            "x.yaml:1: 'dropout' must be a number >= 0 and < 1, got '1'; correct the value");
  EXPECT_EQ(error("shuffle: yes"),
            "x.yaml:1: 'shuffle' must be true or false, got 'yes'; correct the value");
  EXPECT_EQ(error("name: [a]"), "x.yaml:1: 'name' must be text, got a list; correct the value");
  EXPECT_EQ(error("name: {a: b}"),
            "x.yaml:1: 'name' must be text, got a section; correct the value");
  EXPECT_EQ(error("net: 3"),
            "x.yaml:1: 'net' must be a section of 'key: value' lines, got '3'; correct the value");
  EXPECT_EQ(error("milestones: 3"),
            "x.yaml:1: 'milestones' must be a list such as [a, b], got '3'; correct the value");
  EXPECT_EQ(error("milestones:\n  - 3\n  - x\n"),
            "x.yaml:3: 'milestones.1' must be a whole number > 0, got 'x'; correct the value");
  EXPECT_EQ(error("layers:\n  - width: 1\n  - width: 0\n"),
            "x.yaml:3: 'layers.1.width' must be a whole number > 0, got '0'; correct the value");
  EXPECT_EQ(error("milestones: [1, 2, 3, 4]"),
            "x.yaml:1: 'milestones' has more than 3 items; remove some");
}

TEST_F(TrainConfig, ChoicesSuggestTheNearest) {
  EXPECT_EQ(error("net:\n  space: quaternions"),
            "x.yaml:2: 'net.space' must be one of rot6d, quaternion, got 'quaternions'; did you "
            "mean 'quaternion'?");
  EXPECT_EQ(error("loss: l1"),
            "x.yaml:1: 'loss' must be one of mse, huber, got 'l1'; correct the value");
}

TEST_F(TrainConfig, UnknownKeysSuggestTheNearest) {
  EXPECT_EQ(error("name: x\nnet:\n  bacth: 3\n"),
            "x.yaml:3: unknown key 'net.bacth'; did you mean 'batch'?");
  EXPECT_EQ(error("Steps: 3\n"), "x.yaml:1: unknown key 'Steps'; did you mean 'steps'?");
  EXPECT_EQ(error("net: {zzzzz: 3}\n"),
            "x.yaml:1: unknown key 'net.zzzzz'; the keys here are space, batch, clip");
  EXPECT_EQ(error("layers: [{wdth: 3}]"),
            "x.yaml:1: unknown key 'layers.0.wdth'; did you mean 'width'?");
  EXPECT_EQ(error("a\x01: 3\n").find('\x01'), std::string::npos);
  EXPECT_EQ(error(std::string(300, 'k') + ": 3\n").substr(0, 30), "x.yaml:1: unknown key 'kkkkkkk");
  EXPECT_EQ(error<Needy>("dta: x"), "x.yaml:1: unknown key 'dta'; did you mean 'data'?");
  EXPECT_EQ(error<Needy>("\n"), "x.yaml:1: the key 'data' is missing; add it");
  EXPECT_EQ(nearest("batch_size", {"batch", "steps"}), "");
  EXPECT_EQ(nearest("batch-siez", {"batch", "batch_size"}), "batch_size");
  EXPECT_EQ(nearest("x", {"y"}), "");
}

TEST_F(TrainConfig, BrokenYaml) {
  EXPECT_EQ(error("name: [a\nsteps: 3\n").substr(0, 9), "x.yaml:2:");
  EXPECT_NE(error("name: [a\n").find("is not YAML ("), std::string::npos);
  EXPECT_EQ(error("just text"), "x.yaml:1: holds no 'key: value' lines; give a configuration file");
  EXPECT_EQ(error("- a\n"), "x.yaml:1: holds no 'key: value' lines; give a configuration file");
  EXPECT_EQ(
      error("name: a\nsteps: 1\nname: b\n"),
      "x.yaml:3: the key 'name' stands here a second time (first in line 1); keep one of the two");
  EXPECT_EQ(error("name: !!str a"),
            "x.yaml:1: the tag 'tag:yaml.org,2002:str' is not supported; remove it");
  EXPECT_EQ(error("a: &a {batch: 1}\nnet:\n  <<: *a\n"),
            "x.yaml:3: merge keys ('<<') are not supported; use 'include: file.yaml'");
  EXPECT_EQ(error("name: a\n---\nname: b\n").substr(0, 42),
            "x.yaml:2: a second YAML document starts he");
  EXPECT_EQ(
      error("? [a]\n: b\n"),
      "x.yaml:1: a bracket is open, or a list or section stands as a key; write 'key: value'");
  EXPECT_EQ(
      error("? ~\n: b\n"),
      "x.yaml:1: a bracket is open, or a list or section stands as a key; write 'key: value'");
  EXPECT_EQ(error("net: &n\n  batch: *n\n"),
            "x.yaml:2: an alias lies inside its own anchor; remove the alias");
  EXPECT_NE(error("net: *missing\n"), "");
}

TEST_F(TrainConfig, AliasesAreAllowedButBounded) {
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
  EXPECT_NE(error(bomb).find("more than 100000 values, aliases expanded"), std::string::npos);
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

TEST_F(TrainConfig, IncludesMergeAndTheFileItselfWins) {
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
  EXPECT_EQ(find_config(tree, "net.space")->place.text(), folder + "/sub/deep.yaml:3");
  // an error in an included file names that file
  put("sub/deep.yaml", "\nnmae: deep\n");
  EXPECT_EQ(error_of(folder + "/x.yaml"),
            "sub/deep.yaml:2: unknown key 'nmae'; did you mean 'name'?");
}

TEST_F(TrainConfig, IncludeErrors) {
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
  EXPECT_NE(error("include: sub\n").find("is a folder"), std::string::npos);
  // the same file twice is no circle, but files cannot multiply without end
  put("leaf.yaml", "steps: 3\n");
  EXPECT_EQ(error("include: [leaf.yaml, leaf.yaml]\n"), "");
  for (int i = 0; i < 10; ++i) {
    const std::string next = i == 0 ? "leaf.yaml" : "m" + std::to_string(i - 1) + ".yaml";
    put("m" + std::to_string(i) + ".yaml", "include: [" + next + ", " + next + "]\n");
  }
  EXPECT_NE(error("include: m9.yaml\n").find("more than 64 files are included"), std::string::npos);
  EXPECT_NE(error_of(folder + "/absent.yaml"), "");
}

TEST_F(TrainConfig, OverridesWinAndErrorsNameThem) {
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
  EXPECT_EQ(error("", {"net.batch=abc"}),
            "override 'net.batch=abc': 'net.batch' must be a whole number > 0, got 'abc'; correct "
            "the value");
  EXPECT_EQ(error("", {"net.bacth=1"}),
            "override 'net.bacth=1': unknown key 'net.bacth'; did you mean 'batch'?");
  EXPECT_EQ(error("", {"steps.x=1"}),
            "override 'steps.x=1': 'steps' must be a whole number >= 0, got a section; correct the "
            "value");
  EXPECT_EQ(error("steps: 3", {"steps.x=1"}),
            "override 'steps.x=1': 'steps' must be a whole number >= 0, got a section; correct the "
            "value");
  EXPECT_EQ(
      error("", {"steps="}),
      "override 'steps=': 'steps' must be a whole number >= 0, got nothing; correct the value");
  EXPECT_EQ(error("", {"name=[a"}).substr(0, 37), "override 'name=[a': a bracket is open");
  EXPECT_EQ(error("layers: [{width: 1}]", {"layers.1.width=1"}),
            "override 'layers.1.width=1': the list has no item '1'; give a number from 0 to 0");
  for (const char* bad : {"steps", "=3", "a..b=1", ".a=1", "a b=1", "a\nb=1"})
    EXPECT_NE(error("", {bad}).find("is no override; write key=value or key.sub=value"),
              std::string::npos)
        << bad;
  EXPECT_NE(error("", {"include=x.yaml"}).find("unknown key 'include'"), std::string::npos);
}

TEST_F(TrainConfig, ResolvedYamlReadsBackToTheSame) {
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

TEST_F(TrainConfig, ReferenceListsEveryKey) {
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
    EXPECT_NE(table.find(line), std::string::npos) << line << "\n" << table;
  EXPECT_NE(
      config_reference_table(config_reference<Needy>()).find("| `data` | text | `(required)` |"),
      std::string::npos);
}

// Whatever the bytes, the answer is a config or one InputError.
TEST_F(TrainConfig, RandomDamageNeverCrashes) {
  const std::string good =
      "name: 'a b'\nnet: {space: rot6d, batch: 3}\nlayers:\n  - &x {width: 3}\n  - *x\n"
      "milestones: [1, 2]\n# end\nrate: 1e-3\n";
  const std::string alphabet = "[]{}:,-&*!|>'\"%@`#?~ \n\t\\0a<=\x01\xff\xc3";
  Rng rng({7, 1});
  int accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string text = good;
    for (uint64_t edits = 1 + rng.below(4); edits > 0; --edits) {
      const size_t at = rng.below(text.size());
      const char c = alphabet[rng.below(alphabet.size())];
      if (rng.below(3) == 0)
        text.erase(at, rng.below(5));
      else if (rng.below(2) == 0)
        text.insert(at, 1, c);
      else
        text[at] = c;
      if (text.empty()) text = " ";
    }
    try {
      Everything config;
      read_config(parse_yaml(text, "x.yaml"), config);
      ++accepted;
    } catch (const InputError& e) {
      const std::string what = e.what();
      ASSERT_LT(what.size(), 400u) << what;
      ASSERT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }
  EXPECT_GT(accepted, 10);
  EXPECT_LT(accepted, 2500);
}

}  // namespace
}  // namespace restage
