// Tensors, and the pooled allocator: a steady step takes no new large block from the system.
#include "autograd/tensor/tensor.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <new>

#include "autograd/base/error.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"

namespace restage {
namespace {

TEST(TensorShape, CountsAndPrints) {
  const Shape s{2, 3, 4};
  EXPECT_EQ(s.numel(), 24);
  EXPECT_EQ(s.product(1, 3), 12);
  EXPECT_EQ(s[-1], 4);
  EXPECT_EQ(s.str(), "[2, 3, 4]");
  EXPECT_EQ(Shape{}.numel(), 1);
  EXPECT_EQ(Shape{}.str(), "[]");
  EXPECT_EQ((Shape{2, 0}).numel(), 0);
  EXPECT_FALSE((s == Shape{2, 3}));
  EXPECT_THROW((Shape{1, 1, 1, 1, 1, 1, 1}), ShapeError);
  EXPECT_THROW((Shape{-2}), ShapeError);
}

TEST(TensorShape, BroadcastsLikeNumpy) {
  bool ok = false;
  EXPECT_EQ(broadcast_shape({2, 1, 4}, {3, 1}, &ok), (Shape{2, 3, 4}));
  EXPECT_TRUE(ok);
  EXPECT_EQ(broadcast_shape({0}, {1}, &ok), (Shape{0}));
  EXPECT_TRUE(ok);
  broadcast_shape({2}, {3}, &ok);
  EXPECT_FALSE(ok);
  broadcast_shape({0}, {3}, &ok);
  EXPECT_FALSE(ok);
}

TEST(Tensors, AreAlignedWhateverTheirSize) {
  for (const int64_t n : {0, 1, 3, 16, 17, 1000, 70000, 300000})
    for (const DType type : {DType::f32, DType::f64, DType::i32, DType::i64})
      EXPECT_EQ(reinterpret_cast<uintptr_t>(Tensor::empty({n}, type).address()) % 64, 0u);
}

TEST(Tensors, RefuseImpossibleSizes) {
  EXPECT_THROW(Tensor::empty({-1}), ShapeError);
  EXPECT_THROW(Tensor::empty({int64_t{1} << 40, int64_t{1} << 40}), ShapeError);
  EXPECT_THROW(Tensor::empty({0, int64_t{1} << 40, int64_t{1} << 40}), ShapeError);
  EXPECT_THROW(Tensor::from<float>({3}, {1, 2}), ShapeError);
}

TEST(Tensors, ReshapeAndRowsShareMemory) {
  Tensor t = Tensor::from<float>({4, 3}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  const Tensor flat = t.reshape({-1}), middle = t.rows(1, 3);
  EXPECT_EQ(flat.shape(), (Shape{12}));
  EXPECT_EQ(middle.shape(), (Shape{2, 3}));
  t.data<float>()[3] = 42;
  EXPECT_EQ(flat.item(3), 42);
  EXPECT_EQ(middle.item(0), 42);
  const Tensor copy = middle.clone();
  t.data<float>()[3] = 7;
  EXPECT_EQ(copy.item(0), 42);
  EXPECT_EQ(middle.numel(), 6);
  EXPECT_EQ(t.rows(4, 4).numel(), 0);
}

TEST(Tensors, KeepTheirMemoryWhileAViewLives) {
  Tensor view;
  {
    const Tensor t = Tensor::full({8}, 5, DType::f64);
    view = t.rows(6, 8);
  }
  const Tensor other = Tensor::full({8}, 1, DType::f64);  // would take the freed block
  EXPECT_EQ(view.item(0), 5);
}

TEST(Tensors, ReshapeKnowsOneOpenSize) {
  const Tensor t = Tensor::zeros({2, 6});
  EXPECT_EQ(t.reshape({3, -1}).shape(), (Shape{3, 4}));
  EXPECT_EQ(Tensor::zeros({0, 4}).reshape({0, -1}).shape(), (Shape{0, 0}));
  EXPECT_EQ(Tensor::zeros({0, 4}).reshape({-1, 4}).shape(), (Shape{0, 4}));
  EXPECT_THROW(t.reshape({5, -1}), ShapeError);
  EXPECT_THROW(t.reshape({-1, -1}), ShapeError);
  EXPECT_THROW(t.reshape({7}), ShapeError);
  EXPECT_THROW(t.reshape({0, -1}), ShapeError);
  EXPECT_THROW(t.rows(1, 3), ShapeError);
  EXPECT_THROW(t.rows(2, 1), ShapeError);
  EXPECT_THROW(t.rows(-1, 1), ShapeError);
}

TEST(Tensors, ConvertAndGuardTheirDtype) {
  const Tensor t = Tensor::from<double>({3}, {1.5, -2, 3});
  EXPECT_EQ(t.cast(DType::f32).item(0), 1.5);
  EXPECT_EQ(t.cast(DType::i32).item(1), -2);
  EXPECT_EQ(t.cast(DType::i64).to_vector<double>(), (std::vector<double>{1, -2, 3}));
  EXPECT_EQ(t.cast(DType::f64).address(), t.address());
  EXPECT_THROW(t.data<float>(), ShapeError);
  EXPECT_EQ(Tensor::full({2}, 7, DType::i64).item(1), 7);
}

TEST(Tensors, KnowTheirDevice) {
  EXPECT_EQ(Tensor::zeros({1}).device(), (Device{}));
  EXPECT_THROW(Tensor::empty({1}, DType::f32, Device{3, 0}), Error);
}

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
    first = t.address();
  }
  EXPECT_EQ(Tensor::empty({2999999}).address(), first);  // the same size class
}

TEST(PooledMemory, IsGivenBackWhenAsked) {
  trim_memory();
  EXPECT_EQ(memory_stats().kept, 0);
  const int64_t in_use = memory_stats().in_use, taken = memory_stats().large_allocations;
  { const Tensor t = Tensor::empty({3000000}), small = Tensor::empty({3}); }
  EXPECT_GE(memory_stats().kept, 12000000);
  EXPECT_EQ(memory_stats().in_use, in_use);
  trim_memory();
  EXPECT_EQ(memory_stats().kept, 0);
  const Tensor again = Tensor::full({3000000}, 2);
  EXPECT_EQ(memory_stats().large_allocations, taken + 2) << "it was there no more";
  EXPECT_EQ(again.item(2999999), 2);
  trim_memory();
  EXPECT_EQ(again.item(2999999), 2) << "what is in use stays";
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kTakesAllAddresses = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kTakesAllAddresses = true;
#else
constexpr bool kTakesAllAddresses = false;
#endif
#else
constexpr bool kTakesAllAddresses = false;
#endif

/// Takes 600 MiB and gives them to the pool, then 700 MiB of another size, where there is room for
/// a thousand. Exit code 0: there was memory in the end, and none where there really is none.
[[noreturn]] void use_most_of_the_memory() {
  int64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most = static_cast<rlim_t>(pages * ::sysconf(_SC_PAGESIZE)) + (rlim_t{1000} << 20);
  const rlimit limit{most, most};
  if (::setrlimit(RLIMIT_AS, &limit) != 0) std::_Exit(3);
  constexpr int64_t mebi = (1 << 20) / 4;
  for (const int64_t size : {600, 700, 500, 620}) {
    try {
      const Tensor t = Tensor::empty({size * mebi});
    } catch (const std::bad_alloc&) {
      std::_Exit(1);
    }
  }
  try {
    const Tensor t = Tensor::empty({2000 * mebi});
  } catch (const std::bad_alloc&) {
    std::_Exit(0);
  }
  std::_Exit(2);
}

TEST(PooledMemoryDeathTest, IsGivenBackBeforeThereIsNone) {
  if (kTakesAllAddresses) GTEST_SKIP() << "a sanitizer needs all addresses";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(use_most_of_the_memory(), ::testing::ExitedWithCode(0), "");
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
