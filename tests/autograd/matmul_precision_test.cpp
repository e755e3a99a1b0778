// The precision of products: float32 unless somebody asks for less, and the one that an op was made
// with in both of its passes. Only GPUs have another; here it is the emulated one.
#include "autograd/kernels/matmul_precision.h"

#include <gtest/gtest.h>

#include "autograd/gradcheck/evaluate.h"
#include "autograd/kernels/matmul.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"
#include "tests/support/emulated_gpu.h"

namespace restage {
namespace {

using gradcheck::random;
using gradcheck::same_bits;

constexpr auto kTf32 = MatmulPrecision::tf32;

Tensor floats(const Shape& shape, uint64_t stream) {
  return random(shape, stream).cast(DType::f32);
}

/// A product on a device, in the precision that is in use.
Tensor product(const Tensor& a, const Tensor& b, Device device) {
  return matmul(Var(a.to(device)), Var(b.to(device))).value.cpu();
}

TEST(MatmulPrecision, IsFloat32UntilSomebodyAsksForLess) {
  EXPECT_EQ(matmul_precision(), MatmulPrecision::float32);
  const Tensor a = floats({50, 70}, 1), b = floats({70, 30}, 2);
  for (const Device device : {Device{}, emulated_gpu()}) {
    const Tensor before = product(a, b, device);
    Tensor during;
    {
      const MatmulPrecisionScope scope(kTf32);
      EXPECT_EQ(matmul_precision(), kTf32);
      during = product(a, b, device);
    }
    EXPECT_EQ(matmul_precision(), MatmulPrecision::float32);
    EXPECT_EQ(same_bits(during, before), device == Device{}) << "the CPU has float32 only";
    EXPECT_TRUE(same_bits(product(a, b, device), before));
  }
}

TEST(MatmulPrecision, ShortSumsAndFloat64StayAsTheyAre) {
  const std::pair<Tensor, Tensor> exact[] = {
      {floats({40, MatmulArgs::kLeastTerms - 1}, 1), floats({MatmulArgs::kLeastTerms - 1, 50}, 2)},
      {random({40, 64}, 1), random({64, 50}, 2)}};
  for (const auto& [a, b] : exact) {
    const Tensor before = product(a, b, emulated_gpu());
    const MatmulPrecisionScope scope(kTf32);
    EXPECT_TRUE(same_bits(product(a, b, emulated_gpu()), before)) << a.shape().str();
  }
}

TEST(MatmulPrecision, TheBackwardPassMultipliesAsTheForwardPassDid) {
  const Tensor x = floats({40, 70}, 1), w = floats({90, 70}, 2), wide = floats({40, 90}, 3);
  const Tensor frames = floats({3, 40, 70}, 4), state = floats({40, 32}, 5),
               w_ih = floats({96, 70}, 6), w_hh = floats({96, 32}, 7), bias = floats({96}, 8);
  const gradcheck::Sample samples[] = {
      {"linear", {x, w}, [](gradcheck::Args in) { return linear(in[0], in[1]); }},
      {"matmul", {x, wide}, [](gradcheck::Args in) { return matmul(in[0], in[1], true); }},
      {"gru", {frames, state, w_ih, w_hh, bias, bias}, [](gradcheck::Args in) {
         return gru(in[0], in[1], in[2], in[3], in[4], in[5]);
       }}};
  for (const gradcheck::Sample& s : samples) {
    /// Gradients, with the precision of the forward and of the backward pass.
    const auto gradients = [&](MatmulPrecision forward, MatmulPrecision backward) {
      Tape tape;
      std::vector<Var> leaves;
      for (size_t k = 0; k < s.inputs.size(); ++k)
        leaves.push_back(tape.leaf(s.inputs[k].to(emulated_gpu()), k + 1));
      Var y;
      {
        const MatmulPrecisionScope scope(forward);
        y = s.build(leaves);
      }
      const Tensor u = floats(y.shape(), 9).to(emulated_gpu());
      const MatmulPrecisionScope scope(backward);
      const Gradients g = tape.backward(sum_all(mul(y, Var(u))));
      std::vector<Tensor> out;
      for (size_t k = 0; k < s.inputs.size(); ++k) out.push_back(g.find(k + 1)->cpu());
      return out;
    };
    const auto late = gradients(kTf32, MatmulPrecision::float32), all = gradients(kTf32, kTf32),
               none = gradients(MatmulPrecision::float32, MatmulPrecision::float32);
    for (size_t k = 0; k < s.inputs.size(); ++k)
      EXPECT_TRUE(same_bits(late[k], all[k])) << s.title << " input " << k;
    EXPECT_FALSE(same_bits(all[0], none[0])) << s.title << " is not rounded";
  }
}

}  // namespace
}  // namespace restage
