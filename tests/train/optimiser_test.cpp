// The kinds of optimisers against numbers that NumPy gives for PyTorch's formulas (Lion: the
// paper's), on every device; that they resume to the same bits; clipping by value.
#include "train/optim/optimiser.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/evaluate.h"
#include "autograd/kernels/update.h"
#include "nn/config/config.h"
#include "nn/layers/linear.h"
#include "tests/support/emulated_gpu.h"
#include "tests/support/errors.h"
#include "tests/support/fake_device.h"
#include "tests/train/tiny_training.h"
#include "train/selection.h"

namespace restage {
namespace {

using Kind = OptimiserConfig::Kind;

const std::vector<double> kWeights = {1, -2, 0.5};
const std::vector<std::vector<double>> kGradients = {
    {0.5, -1, 0.25}, {-0.3, 0.2, 0.1}, {0.1, 0, -0.6}};
const std::vector<double> kRates = {0.1, 0.05, 0.2};

/// A matrix of one row.
struct Row3 {
  explicit Row3(DType type = DType::f64, Device device = {})
      : layer(3, 1, Init{RngKey{1, 0}, DType::f64}, false) {
    layer.weight.value = on(kWeights, type, device);
  }
  static Tensor on(const std::vector<double>& values, DType type, Device device) {
    Tensor out = Tensor::empty({1, 3}, type);
    for (size_t i = 0; i < values.size(); ++i) {
      const auto at = static_cast<int64_t>(i);
      if (type == DType::f64)
        out.data<double>()[at] = values[i];
      else
        out.data<float>()[at] = static_cast<float>(values[i]);
    }
    return out.to(device);
  }
  Gradients gradient(size_t step) const {
    const Tensor& w = layer.weight.value;
    Gradients out;
    out.set(layer.weight.id, on(kGradients[step], w.dtype(), w.device()));
    return out;
  }
  Linear layer;
};

/// The weights after three steps; after the second everything goes through a file.
Tensor after_three(const OptimiserConfig& config, DType type = DType::f64, Device device = {}) {
  Row3 row(type, device);
  Optimiser first({{"a.", &row.layer}}, config), second({{"a.", &row.layer}}, config);
  for (size_t i = 0; i < 2; ++i) first.step(row.gradient(i), kRates[i]);
  TensorFile file;
  first.save("o.", file);
  second.load("o.", file, "file");
  second.step(row.gradient(2), kRates[2]);
  return row.layer.weight.value.cpu();
}

OptimiserConfig of_kind(Kind kind) {
  OptimiserConfig out;
  out.kind = kind;
  return out;
}

void expect_numbers(const std::string& name, const OptimiserConfig& config,
                    const std::vector<double>& wanted) {
  const std::vector<double> exact = after_three(config).to_vector<double>();
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(exact[i], wanted[i], 1e-14) << name << " " << i;
  const Tensor here = after_three(config, DType::f32);
  for (size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(here.to_vector<float>()[i], wanted[i], 1e-5) << name << " in float32";
  EXPECT_TRUE(gradcheck::same_bits(here, after_three(config, DType::f32, fake_device()))) << name;
  const std::vector<float> gpu = after_three(config, DType::f32, emulated_gpu()).to_vector<float>();
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(gpu[i], wanted[i], 1e-5) << name << " on a GPU";
}

TEST(OptimiserKinds, HaveTheNumbersOfPyTorchsFormulas) {
  OptimiserConfig c = of_kind(Kind::adamw);
  c.adam.weight_decay = 0.1;
  expect_numbers("adamw", c, {0.8076625618008563, -1.7291427971277935, 0.40088240214199067});
  c = of_kind(Kind::sgd);
  c.sgd.weight_decay = 0.01;
  expect_numbers("sgd", c, {0.9415984489999999, -1.9032368979999998, 0.5883242245});
  c.sgd.momentum = 0.9;
  expect_numbers("momentum", c, {0.888366149, -1.724772298, 0.5167080745});
  c.sgd.nesterov = true;
  expect_numbers("nesterov", c, {0.8414077021909999, -1.6561598043819998, 0.6035441010955});
  c = of_kind(Kind::lion);
  c.lion.weight_decay = 0.1;
  expect_numbers("lion", c, {0.716839, -1.682188, 0.5361645});
}

TEST(OptimiserKinds, AdamWWithoutDecayIsAdam) {
  EXPECT_TRUE(
      gradcheck::same_bits(after_three(of_kind(Kind::adamw)), after_three(of_kind(Kind::adam))));
}

TEST(OptimiserKinds, LionRestsWhereItsAverageIsZero) {
  Row3 row;
  Optimiser lion({{"", &row.layer}}, of_kind(Kind::lion));
  Gradients none;
  none.set(row.layer.weight.id, Tensor::zeros({1, 3}, DType::f64));
  lion.step(none, 1);
  EXPECT_EQ(row.layer.weight.value.to_vector<double>(), kWeights);
}

TEST(OptimiserKinds, ADeviceWithoutTheKernelsSaysSo) {
  const WithoutKernels lacking{typeid(MixArgs)};
  test::expect_error<Error>([] { after_three(of_kind(Kind::sgd), DType::f32, fake_device()); },
                            {"fake"});
}

TEST(OptimiserKinds, TrainAStageThatResumesToTheSameBits) {
  for (const Kind kind : {Kind::adamw, Kind::sgd, Kind::lion}) {
    TrainConfig config = testing::tiny_training(4);
    for (OptimiserConfig* o : testing::optimisers(config)) {
      o->kind = kind;
      o->clip_value = 0.5;
      o->sgd.momentum = 0.9;
      o->adam.weight_decay = o->lion.weight_decay = 0.01;
    }
    testing::expect_to_resume("motion", config);
    testing::expect_to_resume("deformation", config);
  }
}

TEST(OptimiserKinds, ConfigurationsThatMakeNoSense) {
  const auto refusal = [](const std::string& yaml) {
    return test::refusal_of([&] {
      OptimiserConfig config;
      read_config(parse_yaml(yaml, "x.yaml"), config);
    });
  };
  EXPECT_HAS(refusal("sgd: {nesterov: true}\n"), "'sgd.nesterov' is a kind of momentum");
  EXPECT_HAS(refusal("kind: muon\ngroups: [{match: a, decay: 0.1}]\n"), "x.yaml:2: 'groups' sets");
  EXPECT_HAS(refusal("groups: [{match: a, frozen: true, frozen_until: 3}]\n"), "frozen");
  EXPECT_HAS(refusal("groups: [{rate: 0.1}]\n"), "match");
  EXPECT_HAS(refusal("kind: lyon\n"), "did you mean 'lion'");
  EXPECT_EQ(refusal("kind: adamw\ngroups: [{match: a, decay: 0.1, rate: 0}]\n"), "");
}

TEST(ClippingByValue, IsTorchsAndComesBeforeTheNorm) {
  OptimiserConfig config = of_kind(Kind::sgd);
  config.clip_value = 0.25;
  Row3 row;
  Optimiser({{"", &row.layer}}, config).step(row.gradient(0), 1);
  EXPECT_EQ(row.layer.weight.value.to_vector<double>(), (std::vector<double>{0.75, -1.75, 0.25}));
  config.clip = 0.1;
  Row3 both;
  Optimiser({{"", &both.layer}}, config).step(both.gradient(0), 1);
  const double left = 0.25 * 0.1 / (std::sqrt(3.0) * 0.25 + 1e-6);
  EXPECT_NEAR(both.layer.weight.value.to_vector<double>()[1], -2 + left, 1e-12);
}

// ---- groups

/// Two layers of three weights.
struct Two {
  Row3 a, b;
  std::vector<std::pair<std::string, Module*>> modules() {
    return {{"net.a.", &a.layer}, {"net.b.", &b.layer}};
  }
  Gradients gradient(size_t step) const {
    Gradients out;
    out.set(a.layer.weight.id, *a.gradient(step).find(a.layer.weight.id));
    out.set(b.layer.weight.id, *b.gradient(step).find(b.layer.weight.id));
    return out;
  }
  std::vector<double> of_a() const { return a.layer.weight.value.to_vector<double>(); }
  std::vector<double> of_b() const { return b.layer.weight.value.to_vector<double>(); }
};

ParameterGroup group(const std::string& match) {
  ParameterGroup out;
  out.match = match;
  return out;
}

TEST(ParameterGroups, TheFirstThatMatchesHolds) {
  OptimiserConfig config = of_kind(Kind::sgd);
  config.sgd.weight_decay = 1;
  config.groups = {group("net.b.*"), group("*")};
  config.groups[0].rate = 0.5;
  config.groups[0].decay = 0;
  Two two;
  Optimiser({two.modules()}, config).step(two.gradient(0), 0.1);
  EXPECT_NEAR(two.of_a()[0], 1 - 0.1 * (0.5 + 1), 1e-15);
  EXPECT_NEAR(two.of_b()[0], 1 - 0.05 * 0.5, 1e-15);
}

TEST(ParameterGroups, FrozenOnesKeepTheirBitsAndHaveNoState) {
  for (const Kind kind : {Kind::adam, Kind::adamw, Kind::sgd, Kind::lion, Kind::muon}) {
    OptimiserConfig config = of_kind(kind);
    config.adam.weight_decay = config.sgd.weight_decay = config.lion.weight_decay = 0.1;
    config.sgd.momentum = 0.9;
    config.groups = {group("*.a.weight")};
    config.groups[0].frozen = true;
    Two two;
    Optimiser optimiser(two.modules(), config);
    optimiser.step(two.gradient(0), 0.1);
    EXPECT_EQ(two.of_a(), kWeights);
    EXPECT_NE(two.of_b(), kWeights);
    TensorFile file;
    optimiser.save("", file);
    EXPECT_FALSE(file.tensors.empty());
    for (const auto& [name, tensor] : file.tensors) EXPECT_TRUE(name.starts_with("net.b.")) << name;
    EXPECT_EQ(optimiser.numbers().frozen, 3);
    EXPECT_TRUE(optimiser.frozen(two.a.layer.weight.id));
    EXPECT_FALSE(optimiser.frozen(two.b.layer.weight.id));
  }
}

TEST(ParameterGroups, AreNotClippedForWhatIsFrozen) {
  OptimiserConfig config = of_kind(Kind::sgd);
  config.clip = 1.2;  // one gradient is of norm 1.146, both of 1.62
  config.groups = {group("net.a.*")};
  config.groups[0].frozen_until = 1;
  Two two;
  Optimiser optimiser(two.modules(), config);
  optimiser.step(two.gradient(0), 1, 0);
  EXPECT_EQ(two.of_a(), kWeights);
  EXPECT_EQ(two.of_b()[1], -1) << "not scaled down";
  optimiser.step(two.gradient(0), 1, 1);
  EXPECT_GT(two.of_b()[1], -1);
  EXPECT_LT(two.of_b()[1], -0.1) << "scaled down";
  EXPECT_NE(two.of_a(), kWeights) << "it begins with step 1";
}

TEST(ParameterGroups, OfNothingAreRefused) {
  const auto refusal = [](const std::vector<ParameterGroup>& groups) {
    OptimiserConfig config;
    config.groups = groups;
    Two two;
    return test::refusal_of([&] { Optimiser(two.modules(), config, "motion.optimiser.groups"); });
  };
  EXPECT_HAS(refusal({group("nett.a.*")}), "motion.optimiser.groups");
  EXPECT_HAS(refusal({group("nett.a.*")}), "did you mean 'net.a.*'?");
  EXPECT_HAS(refusal({group("something_else")}), "net.a.weight, net.b.weight");
  EXPECT_HAS(refusal({group("*"), group("net.a.*")}), "put it before them");
  ParameterGroup all = group("*");
  all.frozen = true;
  EXPECT_HAS(refusal({all}), "freezes every parameter");
  OptimiserConfig none;
  none.groups = {all};
  EXPECT_HAS(test::refusal_of([&] { Optimiser({}, none); }), "nothing to learn");
  none.steps = 0;
  Two two;
  EXPECT_EQ(Optimiser(two.modules(), none).numbers().frozen, 6);
}

/// Groups are read from a configuration, freeze a part of a stage, and go through a checkpoint.
TEST(ParameterGroups, FreezeAPartOfAStage) {
  TrainConfig config = testing::tiny_training(4);
  config.loop.micro_batches = 2;
  ConfigNode tree = write_config(config);
  apply_override(tree,
                 "motion.optimiser.groups=[{match: smrm.enc.*, frozen: true}, "
                 "{match: smrm.dec.*, rate: 0.5, frozen_until: 2}]");
  read_config(tree, config);
  ASSERT_EQ(testing::motion(config).optimiser.groups.size(), 2u);
  const auto stage = testing::tiny_stage("motion", config);
  EXPECT_GT(stage->optimised().frozen, 100);
  TensorFile before, after;
  const auto taken = [&](TensorFile* file) {
    for (const StateEntry& e : stage->weights()) file->tensors[e.name] = e.value->clone();
  };
  taken(&before);
  for (int64_t i = 0; i < 2; ++i) stage->step(i);
  taken(&after);
  int frozen = 0, later = 0, moved = 0;
  for (const StateEntry& e : stage->weights()) {
    if (e.parameter == nullptr) continue;
    const bool same = gradcheck::same_bits(before.tensors[e.name], after.tensors[e.name]);
    const bool enc = e.name.starts_with("smrm.enc."), dec = e.name.starts_with("smrm.dec.");
    EXPECT_EQ(same, enc || dec) << e.name;
    EXPECT_EQ(stage->frozen(e.parameter->id), enc) << e.name;
    (enc ? frozen : dec ? later : moved)++;
  }
  EXPECT_GT(frozen, 0);
  EXPECT_GT(later, 0);
  EXPECT_GT(moved, 0);
  stage->step(2);
  TensorFile third;
  taken(&third);
  for (const StateEntry& e : stage->weights()) {
    if (e.parameter == nullptr) continue;
    const bool same = gradcheck::same_bits(third.tensors[e.name], before.tensors[e.name]);
    EXPECT_EQ(same, e.name.starts_with("smrm.enc.")) << e.name;
  }
  testing::expect_to_resume("motion", config);
  testing::motion(config).optimiser.groups[0].match = "smrm.encc.*";
  EXPECT_HAS(test::refusal_of([&] { testing::tiny_stage("motion", config); }),
             "motion.optimiser.groups");
}

/// The mean of equal numbers may round; what is frozen is copied.
TEST(ParameterGroups, AveragesKeepTheBitsOfWhatIsFrozen) {
  TrainConfig config = testing::tiny_training(20);
  testing::motion(config).optimiser.groups = {group("smrm.enc.*")};
  testing::motion(config).optimiser.groups[0].frozen = true;
  SelectionConfig moving, mean;
  moving.ema = 0.7;
  mean.swa_from = 0.1;
  for (const SelectionConfig& selection : {moving, mean}) {
    const auto stage = testing::tiny_stage("motion", config);
    WeightAverage average(*stage, selection);
    TensorFile before;
    for (const StateEntry& e : stage->weights()) before.tensors[e.name] = e.value->clone();
    for (int64_t i = 0; i < 8; ++i) {
      stage->step(i);
      average.add(i + 1);
    }
    average.exchange();
    for (const StateEntry& e : stage->weights()) {
      if (e.parameter == nullptr) continue;
      const bool same = gradcheck::same_bits(*e.value, before.tensors[e.name]);
      EXPECT_EQ(same, e.name.starts_with("smrm.enc.")) << e.name;
    }
  }
}

}  // namespace
}  // namespace restage
