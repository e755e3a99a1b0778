// State dicts into modules: strict, all or nothing; and name maps.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/layers/norm.h"
#include "nn/models/deformation.h"
#include "nn/weights/state.h"

namespace restage {
namespace {

struct Small : Module {
  Linear fc{2, 3, Init{{1, 2}, DType::f32}};
  BatchNormLayer bn{3, Init{{1, 3}, DType::f32}};
  void visit(Fields& f) override {
    f("fc", fc);
    f("bn", bn);
  }
  const char* kind() const override { return "Small"; }
};

TEST(WeightsState, RoundTripUnderAPrefix) {
  Small a, b;
  for (const StateEntry& e : state_of(a)) *e.value = Tensor::full(e.value->shape(), 0.25);
  TensorFile file = to_file(a, "x.");
  file.tensors["other.thing"] = Tensor::zeros({1});
  file.tensors["x.bn.num_batches_tracked"] = Tensor::zeros({1}, DType::i64);
  load_state(b, file, "x.", "w");
  for (const StateEntry& e : state_of(b)) EXPECT_EQ(e.value->item(1), 0.25) << e.name;
}

TEST(WeightsState, FilesAndModulesShareNoMemory) {
  Small a, b;
  const TensorFile file = to_file(a);
  load_state(b, file, "", "w");
  const double before = file.at("fc.bias", "w").item(0);
  a.fc.bias.value.data<float>()[0] = 9;
  b.fc.bias.value.data<float>()[0] = 8;
  EXPECT_EQ(file.at("fc.bias", "w").item(0), before);
}

TEST(WeightsState, Float64IsCast) {
  Small a;
  TensorFile file = to_file(a);
  file.tensors["fc.bias"] = Tensor::from<double>({3}, {0.1, 0.2, 0.3});
  load_state(a, file, "", "w");
  EXPECT_EQ(a.fc.bias.value.dtype(), DType::f32);
  EXPECT_EQ(a.fc.bias.value.item(0), static_cast<double>(0.1F));
}

TEST(WeightsState, EverythingThatDoesNotFitIsListedAndNothingIsLoaded) {
  Small a;
  TensorFile file = to_file(a);
  for (auto& item : file.tensors) item.second = Tensor::full(item.second.shape(), 7);
  file.tensors.erase("fc.bias");
  file.tensors.erase("bn.weight");
  file.tensors["fc.weight"] = Tensor::zeros({3, 5});
  file.tensors["bn.bias"] = Tensor::zeros({3}, DType::i32);
  file.tensors["bn.running_mean"].data<float>()[1] = std::numeric_limits<float>::quiet_NaN();
  file.tensors["extra"] = Tensor::zeros({1});
  try {
    load_state(a, file, "", "w.safetensors");
    FAIL();
  } catch (const StateError& e) {
    EXPECT_EQ(e.missing, (std::vector<std::string>{"fc.bias", "bn.weight"}));
    EXPECT_EQ(e.unexpected, (std::vector<std::string>{"extra"}));
    ASSERT_EQ(e.unfit.size(), 3u);
    EXPECT_EQ(e.unfit[0], "fc.weight: [3, 5] instead of [3, 2]");
    EXPECT_EQ(e.exit_code, 2);
    const std::string what = e.what(), all = e.details();
    EXPECT_LT(what.size(), 400u);
    EXPECT_EQ(what.find('\n'), std::string::npos);
    EXPECT_NE(what.find("2 missing ('fc.bias', ...)"), std::string::npos) << what;
    EXPECT_NE(what.find("3 unfit"), std::string::npos) << what;
    for (const std::string name : {"fc.bias", "bn.weight", "extra", "bn.running_mean"})
      EXPECT_NE(all.find(name), std::string::npos) << name;
  }
  for (const StateEntry& e : state_of(a)) EXPECT_NE(e.value->item(0), 7) << e.name;
}

TEST(WeightsState, HugeListsStayOneShortLine) {
  Small a;
  TensorFile file;
  for (int i = 0; i < 1000; ++i)
    file.tensors[std::string(300, 'n') + std::to_string(i)] = Tensor::zeros({1});
  file.tensors["fc.weight"] = Tensor::zeros({1, 2, 3, 4, 5, 6});
  try {
    load_state(a, file, "", "some/folder/weights.safetensors");
    FAIL();
  } catch (const StateError& e) {
    EXPECT_LT(std::string(e.what()).size(), 400u) << e.what();
    EXPECT_EQ(e.unexpected.size(), 1000u);
  }
}

TEST(WeightsNames, MapsByNameAndPatternFirstMatchWins) {
  const NameMap map = NameMap::parse(
      "module.head.weight: fc3.weight\n"
      "module.*.bn: ~\n"
      "module.layers.*.lin_*: fc*.*\n"
      "module.*: '*'\n",
      "m.yaml");
  std::string ours;
  EXPECT_TRUE(map.rename("module.head.weight", &ours));
  EXPECT_EQ(ours, "fc3.weight");
  EXPECT_FALSE(map.rename("module.a.b.bn", &ours));
  EXPECT_TRUE(map.rename("module.layers.2.lin_bias", &ours));
  EXPECT_EQ(ours, "fc2.bias");
  EXPECT_TRUE(map.rename("module.other", &ours));
  EXPECT_EQ(ours, "other");
  EXPECT_TRUE(map.rename("untouched", &ours));
  EXPECT_EQ(ours, "untouched");
}

TEST(WeightsNames, ForeignFilesLoadThroughAMap) {
  Small a, b;
  TensorFile foreign;
  for (const auto& [name, t] : to_file(a).tensors) foreign.tensors["net/" + name] = t;
  foreign.tensors["optimizer.step"] = Tensor::zeros({1});
  const NameMap map = NameMap::parse("net/*: '*'\noptimizer.*: ~\n", "m.yaml");
  load_state(b, map.apply(foreign, "f"), "", "f");
  EXPECT_EQ(b.fc.weight.value.item(3), a.fc.weight.value.item(3));
}

TEST(WeightsNames, BadMapsAreBadInput) {
  EXPECT_THROW(NameMap::parse("[a, b]", "m"), InputError);
  EXPECT_THROW(NameMap::parse("a: [b]", "m"), InputError);
  EXPECT_THROW(NameMap::parse("a: {", "m"), InputError);
  EXPECT_THROW(NameMap::parse("'a*': '**'", "m"), InputError);
  EXPECT_THROW(NameMap::parse("'****': a", "m"), InputError);
  for (const std::string deep : {"[", "{a: ", "- ", "? "}) {
    std::string text;
    for (int i = 0; i < 50000; ++i) text += deep;
    EXPECT_THROW(NameMap::parse(text, "m"), InputError) << deep;
  }
  std::string steps;
  for (size_t i = 0; steps.size() < (1 << 18); ++i) steps += std::string(i, ' ') + "a:\n";
  EXPECT_THROW(NameMap::parse(steps, "m"), InputError);
  TensorFile file;
  file.tensors["a"] = file.tensors["b"] = Tensor::zeros({1});
  EXPECT_THROW(NameMap::parse("a: c\nb: c", "m").apply(file, "f"), InputError);
}

}  // namespace
}  // namespace restage
