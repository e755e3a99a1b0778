// Every model, layer and loss against the oracle's numbers (tests/golden/oracle), values and
// gradients, in float64 and float32; the measure itself; and the product's own dropout: the case
// mlp_dropout_masks gives masks, which the product draws itself when it trains. So the masks that
// it drew are read back, through the network alone, and a training pass has to equal with_masks,
// which the oracle checks, with these masks.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "nn/models/deformation.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/state.h"
#include "tests/oracle/oracle_case.h"
#include "tests/support/emulated_gpu.h"
#include "tests/support/expect_near.h"
#include "tests/support/fake_device.h"
#include "tests/support/gpu.h"

namespace restage::oracle {
namespace {

std::string folder() { return std::string(RESTAGE_SOURCE_DIR) + "/tests/golden/oracle/"; }

std::vector<std::string> cases() {
  std::vector<std::string> out;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".safetensors" && !name.starts_with("adam_") &&
        name != "full_size")
      out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::string report(const std::vector<Difference>& differences) {
  std::string out;
  for (const Difference& d : differences) out += d.name + " " + std::to_string(d.error) + "\n";
  return out;
}

class OracleGolden : public ::testing::TestWithParam<std::string> {};

TEST_P(OracleGolden, AgreesInValuesAndGradients) {
  const std::string path = folder() + GetParam() + ".safetensors";
  const TensorFile question = read_safetensors(path);
  const bool f64 = question.metadata.at("dtype") == "f64";
  const std::vector<Difference> found =
      differences(question, answer(question, path), f64 ? 1e-8 : 1e-4);
  EXPECT_TRUE(found.empty()) << report(found);
}

TEST_P(OracleGolden, GivesTheSameBitsOnAnotherDevice) {
  const std::string path = folder() + GetParam() + ".safetensors";
  const TensorFile question = read_safetensors(path);
  EXPECT_TRUE(safetensors_bytes(answer(question, path, fake_device())) ==
              safetensors_bytes(answer(question, path)));
}

TEST_P(OracleGolden, AgreesWithTheKernelsOfTheGpu) {
  const std::string path = folder() + GetParam() + ".safetensors";
  const TensorFile question = read_safetensors(path);
  const bool f64 = question.metadata.at("dtype") == "f64";
  const std::vector<Difference> found =
      differences(question, answer(question, path, emulated_gpu()), f64 ? 1e-8 : 1e-4);
  EXPECT_TRUE(found.empty()) << report(found);
}

INSTANTIATE_TEST_SUITE_P(Cases, OracleGolden, ::testing::ValuesIn(cases()),
                         [](const auto& param) { return param.param; });

TEST(DeviceGpu, AgreesWithTheOracle) {
  RESTAGE_GPU_OR_SKIP(gpu);
  for (const std::string& name : cases()) {
    const std::string path = folder() + name + ".safetensors";
    const TensorFile question = read_safetensors(path);
    const bool f64 = question.metadata.at("dtype") == "f64";
    const std::vector<Difference> found =
        differences(question, answer(question, path, gpu), f64 ? 1e-8 : 1e-4);
    EXPECT_TRUE(found.empty()) << name << "\n" << report(found);
  }
}

TEST(OracleMeasure, AllCasesArePresent) { EXPECT_EQ(cases().size(), 72u); }

TEST(OracleMeasure, NoticesWhatDiffersOrIsMissing) {
  const std::string path = folder() + "gru_f64.safetensors";
  const TensorFile question = read_safetensors(path);
  TensorFile reply = answer(question, path);
  ASSERT_TRUE(differences(question, reply, 1e-8).empty());
  Tensor changed = reply.at("g.weight_hh_l1", "reply").clone();
  changed.data<double>()[3] += 1e-5;
  reply.tensors["g.weight_hh_l1"] = changed;
  reply.tensors.erase("g.in.h0");
  const std::vector<Difference> found = differences(question, reply, 1e-8);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].name, "g.in.h0");
  EXPECT_EQ(found[1].name, "g.weight_hh_l1");
  EXPECT_GT(found[1].error, 1e-7);
}

TEST(OracleMeasure, UnknownOrIncompleteCasesAreBadInput) {
  const std::string path = folder() + "gru_f64.safetensors";
  TensorFile question = read_safetensors(path);
  question.tensors.erase("p.bias_hh_l0");
  EXPECT_THROW(answer(question, path), InputError);
  question.metadata["case"] = "gr";
  EXPECT_THROW(answer(question, path), InputError);
  question.metadata.erase("dtype");
  EXPECT_THROW(answer(question, path), InputError);
}

constexpr double kRate = 0.2, kKept = 1 / (1 - kRate);
constexpr int64_t kRows = 7, kIn = 69, kOut = 22, kWidth = 12;  // those of the case
const Shape kMask = {kRows, kWidth};

/// The network of the case; weights as they were drawn, see below for others.
struct Net : Mlp3 {
  explicit Net(bool softmax) : Mlp3(kIn, kOut, {kWidth, kRate}, softmax, Init{}) {
    cast_module(*this, DType::f64);
    name_scopes(*this, "net");
  }
};

/// What the hidden layers of a training pass are multiplied with, as zeros and ones.
struct Masks {
  Tensor first, second;
};

Tensor train(const Mlp3& net, RngKey step, const Tensor& x) {
  Context ctx{nullptr, true, step};
  return net(ctx, x).value;
}

void fill(Parameter& p, double value) {
  p.value = Tensor::full(p.value.shape(), value, DType::f64);
}

/// Reads the masks of a step. All first hidden units are 1 before dropout. With second hidden units
/// of 1 as well, and outputs equal to these, the outputs are kKept where the second mask is 1.
/// With second units that add up the first ones, each with a power of two of its own, every output
/// whose second unit was kept spells the first mask.
Masks masks_of(RngKey step) {
  Net net(false);
  for (Linear* layer : {&net.fc1, &net.fc2, &net.fc3}) fill(layer->weight, 0), fill(layer->bias, 0);
  fill(net.fc1.bias, 1);
  fill(net.fc2.bias, 1);
  for (int64_t i = 0; i < kWidth; ++i) net.fc3.weight.value.data<double>()[i * kWidth + i] = 1;
  const Tensor x = Tensor::zeros({kRows, kIn}, DType::f64);
  Masks m{Tensor::zeros(kMask, DType::f64), Tensor::zeros(kMask, DType::f64)};
  const Tensor second = train(net, step, x);
  fill(net.fc2.bias, 0);
  for (int64_t i = 0; i < kWidth * kWidth; ++i)
    net.fc2.weight.value.data<double>()[i] = static_cast<double>(1 << i % kWidth);
  const Tensor code = train(net, step, x);
  for (int64_t row = 0; row < kRows; ++row) {
    double sum = 0;
    for (int64_t i = 0; i < kWidth; ++i) {
      const double kept = second.item(row * kOut + i);
      EXPECT_TRUE(kept == 0 || std::abs(kept - kKept) < 1e-12) << kept;
      m.second.data<double>()[row * kWidth + i] = kept > 0 ? 1 : 0;
      sum = std::max(sum, code.item(row * kOut + i) / (kKept * kKept));
    }
    EXPECT_NEAR(sum, std::round(sum), 1e-9);
    for (int64_t i = 0; i < kWidth; ++i)
      m.first.data<double>()[row * kWidth + i] = std::lround(sum) >> i & 1;
  }
  return m;
}

int64_t zeros_in(const Tensor& t) {
  int64_t n = 0;
  for (int64_t i = 0; i < t.numel(); ++i) n += t.item(i) == 0;
  return n;
}

TEST(OracleDropout, ATrainingPassEqualsTheOraclesWithTheMasksThatItDrew) {
  const std::string path = folder() + "mlp_dropout_masks_f64.safetensors";
  const TensorFile question = read_safetensors(path);
  Net net(true);
  for (const StateEntry& e : state_of(net)) *e.value = question.at("p." + e.name, path).clone();
  const Tensor x = question.at("in.x", path), probe = question.at("out.probe", path);

  for (const uint64_t step : {1, 2, 3}) {
    const RngKey key{17, step};
    const Masks m = masks_of(key);
    // 84 draws with a probability of 0.2 each: 17 zeros, deviation 3.7.
    for (const Tensor& mask : {m.first, m.second}) {
      EXPECT_GT(zeros_in(mask), 2);
      EXPECT_LT(zeros_in(mask), 36);
    }
    EXPECT_NE(m.first.to_vector<double>(), m.second.to_vector<double>());

    const auto run = [&](bool own) {
      Tape tape;
      Context ctx{&tape, true, key};
      const uint64_t id = Parameter::next_id();
      const Var in = tape.leaf(x, id);
      const Var y = own ? net(ctx, in) : net.with_masks(ctx, in, m.first, m.second);
      std::vector<Tensor> out = {y.value};
      const Gradients g = tape.backward(sum_all(y * Var(probe)));
      out.push_back(*g.find(id));
      for (const Parameter* p : parameters_of(net)) out.push_back(*g.find(p->id));
      return out;
    };
    const std::vector<Tensor> own = run(true), given = run(false);
    ASSERT_EQ(own.size(), 8u);  // y, x, three weights and biases
    for (size_t i = 0; i < own.size(); ++i)
      expect_near(own[i], given[i], 1e-12,
                  "step " + std::to_string(step) + ", number " + std::to_string(i));
  }
}

}  // namespace
}  // namespace restage::oracle
