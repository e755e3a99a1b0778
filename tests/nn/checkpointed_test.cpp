// Recomputation in the backward pass: the same bits for less memory.
#include "nn/checkpointed.h"

#include <gtest/gtest.h>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"
#include "nn/layers/norm.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

/// Layers with batch norm and dropout: what is random, and what a pass changes.
struct Block : Module {
  Block() : first(6, 40, Init{RngKey{1, 0}}), norm(40, Init{}), second(40, 3, Init{RngKey{2, 0}}) {}
  Var operator()(Context& ctx, const Var& x) {
    const Var h = relu(norm(ctx, first(ctx, x)));
    return second(ctx, dropout(h, 0.3, ctx.next_mask()));
  }
  void visit(Fields& f) override {
    f("first", first);
    f("norm", norm);
    f("second", second);
  }
  const char* kind() const override { return "Block"; }
  Linear first;
  BatchNormLayer norm;
  Linear second;
};

Tensor numbers(const Shape& shape, uint64_t key) {
  Tensor out = Tensor::empty(shape);
  Rng rng(RngKey{key, 0});
  for (int64_t i = 0; i < out.numel(); ++i) out.data<float>()[i] = static_cast<float>(rng.normal());
  return out;
}

struct Pass {
  std::vector<std::vector<float>> all;  ///< value, gradients, buffers
  size_t nodes = 0;
};

Pass pass(bool less_memory, bool frozen = false) {
  Block block;
  Tape tape;
  Context ctx;
  ctx.tape = &tape;
  ctx.training = true;
  ctx.rng = RngKey{7, 0};
  ctx.frozen = frozen;
  const Var x = tape.leaf(numbers({20, 6}, 3), 1'000'000);
  const auto forward = [&](Context& c, std::span<const Var> in) { return block(c, in[0]); };
  Var y = less_memory ? checkpointed(ctx, block, {&x, 1}, forward) : block(ctx, x);
  y = dropout(y, 0.5, ctx.next_mask());  // what comes after draws the same masks
  Pass out;
  out.nodes = tape.size();
  out.all.push_back(y.value.to_vector<float>());
  const Gradients g = tape.backward(mean_all(square(y)));
  out.all.push_back(g.find(1'000'000)->to_vector<float>());
  for (const StateEntry& entry : state_of(block)) {
    const Tensor* gradient = entry.parameter != nullptr ? g.find(entry.parameter->id) : nullptr;
    if (gradient != nullptr) out.all.push_back(gradient->to_vector<float>());
    if (entry.parameter == nullptr) out.all.push_back(entry.value->to_vector<float>());
  }
  return out;
}

TEST(Checkpointed, GivesTheSameBits) {
  for (const bool frozen : {false, true}) {
    const Pass whole = pass(false, frozen), less = pass(true, frozen);
    EXPECT_EQ(whole.all, less.all);
    EXPECT_EQ(whole.all.size(), frozen ? 4u : 10u);
    EXPECT_LT(less.nodes, whole.nodes);
  }
}

TEST(Checkpointed, TakesLessMemory) {
  const auto peak = [](bool less_memory) {
    Linear layer(64, 64, Init{RngKey{1, 0}});
    Tape tape;
    Context ctx;
    ctx.tape = &tape;
    Var x = tape.leaf(numbers({500, 64}, 3), 1'000'000);
    int64_t kept = 0;
    for (int i = 0; i < 8; ++i) {
      const auto many = [&](Context& c, std::span<const Var> in) {
        Var h = in[0];
        for (int k = 0; k < 4; ++k) h = tanh(layer(c, h));
        return h;
      };
      x = less_memory ? checkpointed(ctx, layer, {&x, 1}, many) : many(ctx, {&x, 1});
    }
    for (size_t i = 0; i < tape.size(); ++i)
      if (const Saved* saved = tape.saved(i))
        for (const Tensor& t : saved->tensors()) kept += t.numel();
    return std::pair{kept, tape.backward(mean_all(square(x))).find(1'000'000)->to_vector<float>()};
  };
  const auto whole = peak(false), less = peak(true);
  EXPECT_LT(4 * less.first, whole.first);
  EXPECT_EQ(less.second, whole.second);
}

TEST(Checkpointed, WithoutATapeItIsThePassItself) {
  Block block;
  Context one, other;  // each counts its masks
  const Var x = numbers({20, 6}, 3);
  const auto forward = [&](Context& c, std::span<const Var> in) { return block(c, in[0]); };
  EXPECT_EQ(checkpointed(one, block, {&x, 1}, forward).value.to_vector<float>(),
            block(other, x).value.to_vector<float>());
}

TEST(Checkpointed, RefusesParametersOfOtherModules) {
  Block block, other;
  Tape tape;
  Context ctx;
  ctx.tape = &tape;
  const Var x = tape.leaf(numbers({20, 6}, 3), 1'000'000);
  const Var y = checkpointed(ctx, block, {&x, 1}, [&](Context& c, std::span<const Var> in) {
    return block(c, in[0]) + other(c, in[0]);
  });
  test::expect_error<Error>([&] { tape.backward(mean_all(y)); },
                            {"checkpointed", "another module"});
}

}  // namespace
}  // namespace restage
