// Layers: every dropout of a step has a mask of its own, and the same step has the same masks;
// BatchNormLayer::pooled() is the layers that it stands for, in both modes; and the deformation
// networks' short cut over the points of a sample is the network itself.
#include <gtest/gtest.h>

#include "autograd/gradcheck/evaluate.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/gru.h"
#include "nn/layers/norm.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/smrm.h"
#include "tests/support/errors.h"
#include "tests/support/expect_near.h"

namespace restage {
namespace {

using gradcheck::random;
using gradcheck::same_bits;

const RngKey kStep{3, 4};

Context training_step(const RngKey& key = kStep) { return {nullptr, true, key}; }

/// Two layers with dropout between them; all with the same weights.
struct Recurrent {
  GruLayer layer{6, 16, 2, 0.5, Init{RngKey{5, 0}, DType::f64}};
  Tensor x = random({2, 3, 6}, 1);
  Tensor operator()(Context& ctx) const {
    Var state;
    return layer(ctx, x, &state).value;
  }
};

TEST(Linear, HasItsActivationWithAndWithoutABias) {
  const Tensor x = random({5, 6}, 2);
  Context ctx;
  for (const bool with_bias : {true, false}) {
    const Linear layer(6, 4, Init{RngKey{5, 0}, DType::f64}, with_bias);
    const Tensor plain = layer(ctx, x).value, positive = layer(ctx, x, Activation::relu).value;
    EXPECT_TRUE(same_bits(positive, relu(Var(plain)).value)) << with_bias;
    EXPECT_FALSE(same_bits(positive, plain)) << with_bias;
  }
}

TEST(Conv1d, ValidTakesWholeWindowsOnly) {
  Conv1d layer(1, 1, 4, Init{RngKey{8, 0}, DType::f64});
  layer.weight.value = Tensor::from<double>({1, 1, 4}, {1, 10, 100, 1000});
  layer.bias.value = Tensor::zeros({1}, DType::f64);
  Context ctx;
  const auto ones = [](int64_t l) { return Var(Tensor::full({1, l, 1}, 1, DType::f64)); };
  for (int64_t l = 4; l < 12; ++l)
    for (const int64_t stride : {1, 2, 3, 5}) {
      const Tensor y = layer.valid(ctx, ones(l), stride).value;
      int64_t steps = 0;
      while (steps * stride + 4 <= l) ++steps;
      ASSERT_EQ(y.size(1), steps) << l << ", stride " << stride;
      for (int64_t i = 0; i < steps; ++i) EXPECT_DOUBLE_EQ(y.item(i), 1111);
    }
  for (int64_t l = 0; l < 4; ++l)  // before, a stride of 2 made a window of 3 numbers and a zero
    for (const int64_t stride : {1, 2, 3, 5})
      test::expect_error<ShapeError>([&] { layer.valid(ctx, ones(l), stride); },
                                     {"conv1d", "l is shorter than k"});
  for (const int64_t stride : {0, -1}) {
    test::expect_error<ShapeError>([&] { layer.valid(ctx, ones(9), stride); }, {"stride"});
    test::expect_error<ShapeError>([&] { layer.same(ctx, ones(9), stride); }, {"stride"});
  }
}

TEST(Discriminator, NknsLastLayerIsForSixtyFrames) {
  Discriminator judge{{.nkn_head = true}, Init{RngKey{9, 0}, DType::f64}};
  name_scopes(judge, "judge");
  Context ctx{nullptr, true, kStep};
  const Var condition(random({2, 63}, 2));
  EXPECT_EQ(judge(ctx, Var(random({2, 59, 69}, 1)), condition).shape(), Shape({2}));
  for (const int64_t steps : {29, 43, 58, 60, 119})
    test::expect_error<ShapeError>(
        [&] {
          judge(ctx, Var(random({2, steps, 69}, 1)), condition);
        },
        {"60 frames"});
}

TEST(DropoutMasks, TwoPassesThroughOneNetworkDiffer) {
  const Recurrent net;
  Context ctx = training_step();
  const Tensor first = net(ctx), second = net(ctx);
  EXPECT_FALSE(same_bits(first, second));
  Context evaluation;
  EXPECT_TRUE(same_bits(net(evaluation), net(evaluation))) << "nothing else may differ";

  WeightNet weights({16, 0.2}, Init{RngKey{6, 0}, DType::f64});  // ReLU and dropout in one
  name_scopes(weights, "weights");
  const Tensor x = random({5, 3 * kJoints + 3}, 2);
  EXPECT_FALSE(same_bits(weights.net(ctx, x).value, weights.net(ctx, x).value));
}

TEST(DropoutMasks, TwoNetworksDifferWithoutNames) {
  const Recurrent encoder, decoder;
  Context ctx = training_step();
  const Tensor a = encoder(ctx), b = decoder(ctx);
  EXPECT_FALSE(same_bits(a, b));
  Context plain;
  EXPECT_TRUE(same_bits(encoder(plain), decoder(plain))) << "their weights are the same";
}

TEST(DropoutMasks, TheTwoPassesOfACycleDiffer) {
  const Smrm net({.hidden = 16, .dropout = 0.5}, Init{RngKey{7, 0}, DType::f64});  // unnamed
  const Tensor joints = random({1, 4, kJoints, 3}, 1), trans = random({1, 4, 3}, 2),
               rest = random({1, kJoints, 3}, 3);
  Context ctx = training_step();
  MotionState forth, back;
  const Tensor first = net.forward(ctx, {joints, trans, rest, {}, {}}, &forth).raw.value;
  const Tensor second = net.forward(ctx, {joints, trans, rest, {}, {}}, &back).raw.value;
  EXPECT_FALSE(same_bits(first, second));
}

TEST(DropoutMasks, AreAFunctionOfSeedStepAndCallAlone) {
  Recurrent net, renamed;
  name_scopes(renamed.layer, "a.path.of.its.own");
  Context a = training_step(), b = training_step(), other = training_step(kStep.fold(1));
  for (int call = 0; call < 3; ++call) {
    const Tensor one = net(a);
    EXPECT_TRUE(same_bits(one, renamed(b))) << "call " << call;
    EXPECT_FALSE(same_bits(one, net(other))) << "call " << call;
  }
  EXPECT_EQ(a.masks, 3u);
}

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
      expect_near(y.value, z.value, 1e-12, "value");
      const Gradients ga = tape_a.backward(sum_all(square(y))),
                      gb = tape_b.backward(sum_all(square(z)));
      const auto states = state_of(fused), expected = state_of(parts);
      for (size_t i = 0; i < states.size(); ++i) {
        expect_near(*states[i].value, *expected[i].value, 1e-12, states[i].name);
        if (states[i].parameter != nullptr)
          expect_near(*ga.find(states[i].parameter->id), *gb.find(expected[i].parameter->id), 1e-12,
                      "gradient of " + states[i].name);
      }
    }
    EXPECT_NE(fused.norm.running_mean.item(0), 0);
  }
}

TEST(Mlp3, SharesWhatIsTheSameForAllPointsOfASample) {
  for (const int64_t n : {1, 3, 80}) {  // the last has more samples than numbers to a vector
    WeightNet model({16, 0.2}, Init{RngKey{4, 0}, DType::f64});
    const Mlp3* net = &model.net;
    const Tensor vector = random({n, 3 * kJoints}, 1), points = random({n, 5, 3}, 2);
    std::vector<Gradients> gradients;
    std::vector<Tensor> values;
    for (const bool shared : {false, true}) {
      Tape tape;
      Context ctx{&tape, true, RngKey{9, 0}};  // with dropout
      const Var v = tape.leaf(vector, 1000001), p = tape.leaf(points, 1000002);
      const Var y = shared ? net->at_points(ctx, v, p) : (*net)(ctx, join_points(v, p));
      values.push_back(y.value);
      const Var weighted = y * Var(random(y.shape(), 3));
      gradients.push_back(tape.backward(sum(reshape(weighted, {-1}), 0)));
    }
    expect_near(values[0], values[1], 1e-11, "value");
    std::vector<uint64_t> ids = {1000001, 1000002};
    for (const Parameter* parameter : parameters_of(model)) ids.push_back(parameter->id);
    for (const uint64_t id : ids) {
      ASSERT_TRUE(gradients[0].find(id) && gradients[1].find(id));
      expect_near(*gradients[0].find(id), *gradients[1].find(id), 1e-11, "gradient");
    }
  }
}

}  // namespace
}  // namespace restage
