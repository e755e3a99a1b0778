// The full-size networks with weights that follow from a formula: the same outputs as PyTorch's,
// number by number and in checksums, the same order of parameters, the counts of the papers; and
// fifty steps of Adam in both precisions.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "autograd/kernels/update.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/registry.h"
#include "nn/models/skeleton.h"
#include "nn/models/smrm.h"
#include "nn/weights/safetensors.h"
#include "tests/support/emulated_gpu.h"
#include "train/optim/adam.h"

namespace restage {
namespace {

const TensorFile& golden(const std::string& name) {
  static std::map<std::string, TensorFile> files;
  const std::string path =
      std::string(RESTAGE_SOURCE_DIR) + "/tests/golden/oracle/" + name + ".safetensors";
  if (files.count(name) == 0) files[name] = read_safetensors(path);
  return files[name];
}

/// Values in [-scale, scale) from integer arithmetic alone.
Tensor hash_fill(const Shape& shape, uint32_t tag, double scale = 1) {
  std::vector<double> out;
  for (int64_t k = 0; k < shape.numel(); ++k) {
    uint32_t x = static_cast<uint32_t>(k) * 2654435761u + tag * 40503u + 12345u;
    x ^= x >> 16;
    x *= 2246822519u;
    x ^= x >> 13;
    x *= 3266489917u;
    x ^= x >> 16;
    out.push_back(scale * (static_cast<double>(x) / 2147483648.0 - 1));
  }
  return Tensor::from<double>(shape, out);
}

bool is_norm_scale(const StateEntry& e) {
  const std::string ending = "weight";
  return e.value->rank() == 1 && e.name.size() >= ending.size() &&
         e.name.compare(e.name.size() - ending.size(), ending.size(), ending) == 0;
}

/// Parameter number i gets tag i; norm scales get 1 added. The oracle fills float32 networks, so
/// that the parameters are rounded to float32 also where it computes in float64.
void hash_init(Module& module, DType type) {
  uint32_t i = 0;
  for (const StateEntry& e : state_of(module)) {
    if (e.parameter == nullptr) continue;
    const Shape& shape = e.value->shape();
    const int64_t fan = shape.rank() > 1 ? shape.product(1, shape.rank()) : shape.numel();
    Tensor t = hash_fill(shape, i++, 1 / std::sqrt(static_cast<double>(fan)));
    if (is_norm_scale(e))
      for (int64_t k = 0; k < t.numel(); ++k) t.data<double>()[k] += 1;
    *e.value = t.cast(DType::f32);
  }
  cast_module(module, type);
}

struct Inputs64 {
  Tensor cloud, joints, trans, rest, points, axis_angle;
  Inputs64()
      : cloud(hash_fill({1, 1024, 3}, 900)),
        joints(hash_fill({1, 4, 22, 3}, 901, 0.5)),
        trans(hash_fill({1, 4, 3}, 902, 0.1)),
        rest(hash_fill({1, 22, 3}, 903, 0.5)),
        points(hash_fill({1, 5, 3}, 904, 0.5)),
        axis_angle(hash_fill({1, 66}, 905, 0.5)) {
    const float size[] = {0.4f, 0.9f, 0.2f};  // float32 in the oracle, too
    for (int64_t i = 0; i < cloud.numel(); ++i)
      cloud.data<double>()[i] *= static_cast<double>(size[i % 3]);
  }
};

/// All elements agree to `tolerance` times the largest.
void expect_same(const std::string& name, const Tensor& got, double tolerance) {
  const Tensor& want = golden("full_size").at(name, "full_size");
  ASSERT_EQ(got.numel(), want.numel()) << name;
  double largest = 0, worst = 0;
  for (int64_t i = 0; i < want.numel(); ++i) {
    largest = std::max(largest, std::abs(want.item(i)));
    worst = std::max(worst, std::abs(want.item(i) - got.item(i)));
  }
  EXPECT_LE(worst, tolerance * largest) << name;
}

/// Mean and standard deviation of an output, as PyTorch said them when this test was written: the
/// golden file, which can be made again, is not the only witness. smrm_quat has no line here.
void expect_checksums(const std::string& name, const Tensor& got) {
  static const std::map<std::string, std::pair<double, double>> table = {
      {"extractor", {8.760296033e-03, 8.443566307e-02}},
      {"pointnet", {1.028732156e-02, 7.360165882e-02}},
      {"smrm_6d_raw", {-3.012971865e-05, 5.149555787e-02}},
      {"smrm_6d_joints", {-2.297325978e-01, 5.563393147e-01}},
      {"smrm_6d_trans", {1.521169929e-01, 2.289932941e-01}},
      {"w_net", {4.545454545e-02, 5.947490230e-03}},
      {"o_net", {-2.606868720e-01, 1.183241060e-01}},
      {"third_mlp", {-2.611650671e-01, 9.988026663e-02}},
      {"v1_field", {4.545454545e-02, 6.474798699e-03}},
      {"discriminator", {-2.739868872e-01, 6.112298581e-03}}};
  const auto found = table.find(name);
  if (found == table.end()) return;
  double sum = 0, squares = 0;
  const auto n = static_cast<double>(got.numel());
  for (int64_t i = 0; i < got.numel(); ++i) sum += got.item(i);
  for (int64_t i = 0; i < got.numel(); ++i) squares += std::pow(got.item(i) - sum / n, 2);
  const auto [mean, deviation] = found->second;
  EXPECT_NEAR(sum / n, mean, 1e-9 * std::max(std::abs(mean), deviation)) << name;
  EXPECT_NEAR(std::sqrt(squares / n), deviation, 1e-9 * deviation) << name;
}

class FullSize : public ::testing::TestWithParam<DType> {
 protected:
  DType type() const { return GetParam(); }
  Tensor in(const Tensor& t) const { return t.cast(type()); }
  void expect(const std::string& name, const Var& value) const {
    // Float32 runs of the oracle itself differ from float64 by up to 2e-6.
    if (type() == DType::f64) {
      expect_same(name + ".f64", value.value, 1e-10);
      expect_checksums(name, value.value);
    } else {
      expect_same(name + ".f32", value.value, 1e-5);
    }
  }
  std::unique_ptr<Module> make(const std::string& name) const {
    auto model = make_model(name, model_config(name), Init{});
    hash_init(*model, type());
    return model;
  }
  Inputs64 inputs;
  Context ctx;
};

TEST_P(FullSize, Extractors) {
  for (const std::string name : {"point_transformer", "pointnet"}) {
    auto model = make("skeleton/" + name);
    expect(name == "pointnet" ? name : "extractor",
           dynamic_cast<SkeletonModel&>(*model).forward(ctx, in(inputs.cloud)).joints);
  }
}

TEST_P(FullSize, Smrm) {
  for (const std::string form : {"6d", "quat"}) {
    auto model = make(form == "6d" ? "smrm/rot6d" : "smrm/quaternion");
    MotionState state;
    const MotionOutput y = dynamic_cast<MotionModel&>(*model).forward(
        ctx, {in(inputs.joints), in(inputs.trans), in(inputs.rest), {}, {}}, &state);
    expect("smrm_" + form + "_joints", y.joints);
    expect("smrm_" + form + "_trans", y.trans);
    expect("smrm_" + form + "_raw", y.raw);
  }
}

TEST_P(FullSize, DeformationAndDiscriminator) {
  const auto run = [&](const std::string& name, const Var& x) {
    auto model = make("deformation/" + name);
    return dynamic_cast<Mlp3&>(*model)(ctx, x);
  };
  const auto skinning = [&](const std::string& name, const Var& joints, const Var& at) {
    auto model = make("deformation/" + name);
    return dynamic_cast<DeformationModel&>(*model).weights(ctx, joints, at);
  };
  const Tensor rest = in(inputs.rest), points = in(inputs.points);
  expect("w_net", skinning("weights", rest, points));
  expect("o_net", run("offsets", join_points(in(inputs.axis_angle), points)));
  expect("third_mlp", run("root", rest.reshape({1, 66})));
  expect("v1_field", skinning("v1_field", rest, points));
  auto model = make("smrm/discriminator");
  expect("discriminator", dynamic_cast<Discriminator&>(*model)(ctx, in(hash_fill({2, 29, 69}, 906)),
                                                               in(hash_fill({2, 63}, 907))));
}

INSTANTIATE_TEST_SUITE_P(Types, FullSize, ::testing::Values(DType::f64, DType::f32),
                         [](const auto& p) { return std::string(name_of(p.param)); });

TEST(FullSizeFormulas, HashAndFarthestPoints) {
  expect_same("hash_probe", hash_fill({8}, 5), 0);
  const Tensor picked = fps(Inputs64().cloud, 256);
  expect_same("fps_256", picked, 0);
}

TEST(FullSizeModels, ParametersStandInTheOraclesOrder) {
  const std::map<std::string, std::string> orders = {{"extractor", "skeleton/point_transformer"},
                                                     {"pointnet", "skeleton/pointnet"},
                                                     {"smrm", "smrm/rot6d"},
                                                     {"mlp3", "deformation/weights"},
                                                     {"discriminator", "smrm/discriminator"}};
  for (const auto& [key, name] : orders) {
    std::istringstream words(golden("full_size").metadata.at("order." + key));
    std::vector<std::string> want, got;
    for (std::string word; words >> word;) want.push_back(word);
    auto model = make_model(name, model_config(name), Init{});
    for (const StateEntry& e : state_of(*model))
      if (e.parameter != nullptr) got.push_back(e.name);
    EXPECT_EQ(got, want) << name;
  }
}

struct Vector7 : Module {
  Parameter w{hash_fill({7}, 3)};
  void visit(Fields& f) override { f("w", w); }
  const char* kind() const override { return "Vector"; }
};

std::map<std::string, AdamConfig> adam_settings() {
  AdamConfig beta, decay;
  beta.beta1 = 0.5;
  decay.weight_decay = 1e-2;
  return {{"default", {}}, {"beta05", beta}, {"decay", decay}};
}

TEST(OracleAdam, FiftyStepsInThreeSettings) {
  for (const auto& [name, config] : adam_settings()) {
    Vector7 model;
    Adam adam(named_parameters({{"", &model}}), config);
    for (uint32_t i = 0; i < 50; ++i) {
      Tape tape;
      const Var w = tape.leaf(model.w.value, model.w.id);
      const Var loss = sum_all(square(square(w))) + sum_all(w * Var(hash_fill({7}, 10 + i)));
      adam.step(tape.backward(loss), 1e-2, 1);
      const std::string step = name + "." + std::to_string(i);
      const Tensor& want = golden("adam_f64").at(step, "adam_f64");
      for (int64_t k = 0; k < 7; ++k)
        ASSERT_NEAR(model.w.value.item(k), want.item(k), 1e-12) << step;
    }
  }
}

/// Fifty steps of the kernel in float32, by the gradients of tests/oracle/cases/formulas.py.
void expect_adam_f32(const std::string& name, const AdamConfig& c, Device device) {
  const auto numbers = [&](uint32_t tag) {
    return hash_fill({7}, tag).cast(DType::f32).to(device);
  };
  Tensor w = numbers(3), m = Tensor::zeros({7}, DType::f32, device), v = m.clone();
  const auto want = [&](const std::string& of) { return golden("adam_f32").at(of, "adam_f32"); };
  for (int i = 0; i < 50; ++i) {
    launch(AdamArgs{numbers(10 + static_cast<uint32_t>(i)), w, m, v, 1e-2, c.beta1, c.beta2, c.eps,
                    c.weight_decay, 1, i + 1});
    const std::string step = name + "." + std::to_string(i);
    for (int64_t k = 0; k < 7; ++k) ASSERT_NEAR(w.cpu().item(k), want(step).item(k), 2e-6) << step;
  }
  for (int64_t k = 0; k < 7; ++k) {
    EXPECT_NEAR(m.cpu().item(k), want(name + ".m").item(k), 1e-7) << name;
    // What kernels/update.h says of 1 - beta2.
    EXPECT_NEAR(v.cpu().item(k) / want(name + ".v").item(k) - 1, -1.29e-5, 1e-6) << name;
  }
}

TEST(OracleAdam, InFloat32ItIsAsNearAsItsHeaderSays) {
  for (const auto& [name, config] : adam_settings())
    for (const Device device : {Device{}, emulated_gpu()}) {
      SCOPED_TRACE(name_of(device));
      expect_adam_f32(name, config, device);
    }
}

}  // namespace
}  // namespace restage
