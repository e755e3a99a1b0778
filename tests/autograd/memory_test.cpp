// The pooled allocator: a steady step takes no new large block from the system.
#include <gtest/gtest.h>

#include "autograd/ops/linear.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"

namespace restage {
namespace {

Gradients step(const std::vector<Tensor>& weights) {
  Tape tape;
  std::vector<Var> w;
  for (size_t i = 0; i < weights.size(); ++i) w.push_back(tape.leaf(weights[i], i + 1));
  const Var x(Tensor::full({2000, 256}, 0.5));
  const Var h = batch_norm(linear(x, w[0], w[1], Activation::relu), w[1], w[1]);
  const Var sequence = reshape(softmax(h), {20, 100, 256});
  const Var y = gru(sequence, Var(Tensor::zeros({100, 64})), w[2], w[3], w[4], w[4]);
  return tape.backward(mean_all(square(y)));
}

TEST(PooledMemory, ASteadyStepMakesNoLargeAllocation) {
  std::vector<Tensor> weights;
  for (const Shape& s : {Shape{256, 256}, Shape{256}, Shape{192, 256}, Shape{192, 64}, Shape{192}})
    weights.push_back(Tensor::full(s, 0.01));
  step(weights);
  step(weights);
  const int64_t before = memory_stats().large_allocations;
  EXPECT_GT(before, 0) << "the step must use large blocks to show anything";
  const int64_t in_use = memory_stats().in_use;
  for (int i = 0; i < 5; ++i) step(weights);
  EXPECT_EQ(memory_stats().large_allocations, before);
  EXPECT_EQ(memory_stats().in_use, in_use) << "a step must give all of its memory back";
}

TEST(PooledMemory, PeakFollowsUse) {
  constexpr int64_t bytes = int64_t{8} << 20;
  reset_peak_memory();
  const int64_t before = memory_stats().in_use;
  EXPECT_EQ(memory_stats().peak, before);
  { const Tensor t = Tensor::empty({bytes / 4}); }
  EXPECT_EQ(memory_stats().in_use, before);
  EXPECT_GE(memory_stats().peak, before + bytes);
  EXPECT_LE(memory_stats().peak, before + bytes + bytes / 8);
  reset_peak_memory();
  EXPECT_EQ(memory_stats().peak, before);
}

TEST(PooledMemory, ABlockIsUsedAgain) {
  const void* first = nullptr;
  {
    const Tensor t = Tensor::empty({3000000});
    first = t.raw();
  }
  EXPECT_EQ(Tensor::empty({2999999}).raw(), first);  // the same size class
}

TEST(PooledMemory, InferenceKeepsNothing) {
  const Var x(Tensor::full({512, 1024}, 0.1)), w(Tensor::full({1024, 1024}, 0.001)),
      b(Tensor::zeros({1024}));
  reset_peak_memory();
  const int64_t before = memory_stats().in_use;
  Var h = x;
  for (int i = 0; i < 10; ++i) h = linear(h, w, b, Activation::relu);
  EXPECT_LE(memory_stats().peak - before, 3 * 512 * 1024 * 4) << "two layers at a time, not ten";
}

}  // namespace
}  // namespace restage
