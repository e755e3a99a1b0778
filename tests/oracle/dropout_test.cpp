// The product's own dropout against the oracle. The case mlp_dropout_masks gives masks, which the
// product draws itself when it trains. So the masks that it drew are read back, through the network
// alone, and a training pass has to equal with_masks, which the oracle checks, with these masks.
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "nn/models/deformation.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/state.h"

namespace restage {
namespace {

constexpr double kRate = 0.2, kKept = 1 / (1 - kRate);
constexpr int64_t kRows = 7, kIn = 69, kOut = 22, kWidth = 12;  // those of the case
const Shape kMask = {kRows, kWidth};

/// The network of the case; weights as they were drawn, see below for others.
struct Net : Mlp3 {
  explicit Net(bool softmax) : Mlp3(kIn, kOut, kWidth, kRate, softmax, Init{}) {
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

void expect_close(const Tensor& got, const Tensor& want, const std::string& what) {
  ASSERT_EQ(got.numel(), want.numel()) << what;
  for (int64_t i = 0; i < want.numel(); ++i)
    ASSERT_NEAR(got.item(i), want.item(i), 1e-12 * (1 + std::abs(want.item(i))))
        << what << " " << i;
}

TEST(OracleDropout, ATrainingPassEqualsTheOraclesWithTheMasksThatItDrew) {
  const std::string path =
      std::string(RESTAGE_SOURCE_DIR) + "/tests/golden/oracle/mlp_dropout_masks_f64.safetensors";
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
      expect_close(own[i], given[i],
                   "step " + std::to_string(step) + ", number " + std::to_string(i));
  }
}

}  // namespace
}  // namespace restage
