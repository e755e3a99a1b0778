// BatchNormLayer::pooled() against the layers that it stands for, in both modes.
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/norm.h"

namespace restage {
namespace {

constexpr int64_t kIn = 5, kOut = 37;

/// A 1x1 convolution and its norm, in float64; the same numbers every time.
struct Trunk : Module {
  Trunk() : map(kIn, kOut, init(), true, 1), norm(kOut, init()) {
    norm.weight.value = gradcheck::random({kOut}, 1, 0.1);
    norm.bias.value = gradcheck::random({kOut}, 2);
  }
  static Init init() { return {RngKey{3, 0}, DType::f64}; }
  void visit(Fields& f) override {
    f("map", map);
    f("norm", norm);
  }
  const char* kind() const override { return "Trunk"; }
  Linear map;
  BatchNormLayer norm;
};

void expect_near(const Tensor& a, const Tensor& b, const std::string& what) {
  ASSERT_EQ(a.shape(), b.shape()) << what;
  for (int64_t i = 0; i < a.numel(); ++i)
    ASSERT_NEAR(a.item(i), b.item(i), 1e-12 * (1 + std::abs(b.item(i)))) << what << " " << i;
}

TEST(PooledNormLayer, IsConvolutionNormAndMaximumInTrainingAndEvaluation) {
  for (const Activation act : {Activation::none, Activation::relu}) {
    Trunk fused, parts;
    for (const uint64_t step : {1, 2, 3}) {
      const bool training = step < 3;  // the last one with the averages of the first two
      Tape tape_a, tape_b;
      Context a{&tape_a, training, RngKey{}}, b{&tape_b, training, RngKey{}};
      const Var x = gradcheck::random({2, 19, kIn}, 10 + step);
      const Var y = fused.norm.pooled(a, fused.map, x, act);
      const Var wide = parts.norm(b, parts.map(b, x));
      const Var z = max(act == Activation::relu ? relu(wide) : wide, 1);
      expect_near(y.value, z.value, "value");
      const Gradients ga = tape_a.backward(sum_all(square(y))),
                      gb = tape_b.backward(sum_all(square(z)));
      const auto states = state_of(fused), expected = state_of(parts);
      for (size_t i = 0; i < states.size(); ++i) {
        expect_near(*states[i].value, *expected[i].value, states[i].name);
        if (states[i].parameter != nullptr)
          expect_near(*ga.find(states[i].parameter->id), *gb.find(expected[i].parameter->id),
                      "gradient of " + states[i].name);
      }
    }
    EXPECT_NE(fused.norm.running_mean.item(0), 0);
  }
}

}  // namespace
}  // namespace restage
