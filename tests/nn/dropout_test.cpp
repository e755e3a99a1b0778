// Every dropout of a step has a mask of its own, and the same step has the same masks.
#include <gtest/gtest.h>

#include "autograd/gradcheck/evaluate.h"
#include "nn/layers/gru.h"
#include "nn/models/deformation.h"
#include "nn/models/smrm.h"

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
  SmrmConfig config;
  config.hidden = 16;
  config.dropout = 0.5;
  const Smrm net(config, Init{RngKey{7, 0}, DType::f64});  // without name_scopes()
  const Tensor joints = random({1, 4, kJoints, 3}, 1), trans = random({1, 4, 3}, 2),
               rest = random({1, kJoints, 3}, 3);
  Context ctx = training_step();
  MotionState forth, back;
  const Tensor first = net.forward(ctx, joints, trans, rest, &forth).raw.value;
  const Tensor second = net.forward(ctx, joints, trans, rest, &back).raw.value;
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

}  // namespace
}  // namespace restage
