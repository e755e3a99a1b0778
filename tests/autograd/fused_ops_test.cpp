// Fused ops against their composed references.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "autograd/gradcheck/evaluate.h"
#include "autograd/gradcheck/references.h"
#include "autograd/kernels/stats.h"
#include "autograd/ops/attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/points.h"
#include "autograd/ops/pooled_norm.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"
#include "autograd/ops/transport.h"
#include "tests/support/expect_near.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

using gradcheck::Args;
using gradcheck::attention_pool_reference;
using gradcheck::Build;
using gradcheck::elain_reference;
using gradcheck::evaluate;
using gradcheck::Evaluation;
using gradcheck::gru_reference;
using gradcheck::modulate_reference;
using gradcheck::neighbour_attention_reference;
using gradcheck::pooled_norm_reference;
using gradcheck::random;
using gradcheck::same_bits;
using gradcheck::Sample;
using gradcheck::sinkhorn_reference;

/// Values and gradients of two ways to compute the same.
void expect_equal(const std::vector<Tensor>& inputs, const Build& fused, const Build& reference,
                  double tolerance) {
  const Sample a{"fused", inputs, fused}, b{"reference", inputs, reference};
  const Tensor u = random(gradcheck::value_of(a, inputs).shape(), 3).cast(inputs[0].dtype());
  const Evaluation ea = evaluate(a, u), eb = evaluate(b, u);
  expect_near(ea.value, eb.value, tolerance, "value");
  for (size_t k = 0; k < inputs.size(); ++k)
    expect_near(ea.gradients[k], eb.gradients[k], tolerance, "gradient " + std::to_string(k));
}

/// The same in both precisions.
void expect_fused(const std::vector<Tensor>& inputs, const Build& fused, const Build& reference) {
  expect_equal(inputs, fused, reference, 1e-11);
  std::vector<Tensor> narrow;
  for (const Tensor& t : inputs) narrow.push_back(t.cast(DType::f32));
  expect_equal(narrow, fused, reference, 2e-4);
}

TEST(FusedOps, GruIsItsReference) {
  struct Sizes {
    int64_t t, n, i, h;
  };
  // Then more rows than a panel and more units than a block; then frames: of few rows and whole
  // blocks of units, whose weights are read as they lie, and of more rows or other numbers of
  // units.
  for (const auto& [t, n, i, h] :
       {Sizes{7, 3, 4, 1}, Sizes{7, 3, 4, 5}, Sizes{7, 3, 4, 16}, Sizes{3, 14, 5, 40},
        Sizes{1, 1, 69, 64}, Sizes{1, 2, 64, 32}, Sizes{1, 3, 1, 96}, Sizes{1, 4, 20, 320},
        Sizes{1, 5, 20, 64}, Sizes{1, 2, 7, 33}, Sizes{1, 1, 0, 32}}) {
    SCOPED_TRACE((Shape{t, n, i, h}).str());
    expect_fused(
        {random({t, n, i}, 1), random({n, h}, 2), random({3 * h, i}, 3), random({3 * h, h}, 4),
         random({3 * h}, 5), random({3 * h}, 6)},
        [](Args x) { return gru(x[0], x[1], x[2], x[3], x[4], x[5]); },
        [](Args x) { return gru_reference(x[0], x[1], x[2], x[3], x[4], x[5]); });
  }
}

/// Every frame of x [t, n, i] alone, on a tape or without, as gru() gives them all together.
void expect_frames_of_the_sequence(const Tensor& x, const Tensor& h0, const Build& weights_with) {
  const Tensor all = weights_with({Var(x), Var(h0)}).value;
  for (const bool taped : {false, true}) {
    Tape tape;
    Var state = taped ? tape.leaf(h0, 1) : Var(h0);
    for (int64_t i = 0; i < x.size(0); ++i) {
      const Var y = weights_with({Var(x.rows(i, i + 1)), state});
      EXPECT_TRUE(same_bits(y.value, all.rows(i, i + 1))) << "frame " << i;
      state = reshape(y, h0.shape());
    }
  }
}

TEST(FusedOps, AFrameOfAGruAloneHasTheBitsOfTheSequence) {
  for (const int64_t n : {1, 2, 3, 4, 5})
    for (const int64_t h : {33, 64, 320}) {
      SCOPED_TRACE(std::to_string(n) + " rows, " + std::to_string(h) + " units");
      std::vector<Var> weights;
      for (const Shape& shape : {Shape{3 * h, 69}, Shape{3 * h, h}, Shape{3 * h}, Shape{3 * h}})
        weights.emplace_back(random(shape, 2 + weights.size()).cast(DType::f32));
      for (const int count : {1, 2, 3}) {
        const testing::UseThreads use(count);
        expect_frames_of_the_sequence(random({4, n, 69}, 1).cast(DType::f32),
                                      random({n, h}, 6).cast(DType::f32), [&](Args x) {
                                        return gru(x[0], x[1], weights[0], weights[1], weights[2],
                                                   weights[3]);
                                      });
      }
    }
}

TEST(FusedOps, AFrameOfAGruWithoutATapeHasTheSameBitsOnAllVectorSets) {
  const auto sets = testing::vector_sets();
  if (sets.size() < 2) GTEST_SKIP() << "this processor has fewer than two vector sets";
  for (const int64_t n : {1, 3, 4})
    for (const int64_t h : {16, 48, 320}) {  // 16 and 48 fill blocks of AVX2 only
      const auto frame = [&](const std::string& set) {
        const testing::UseSet use(set);
        const auto input = [](const Shape& shape, uint64_t stream) {
          return Var(random(shape, stream).cast(DType::f32));
        };
        return gru(input({1, n, 69}, 1), input({n, h}, 2), input({3 * h, 69}, 3),
                   input({3 * h, h}, 4), input({3 * h}, 5), input({3 * h}, 6))
            .value;
      };
      const Tensor first = frame(sets[0]);
      for (size_t i = 1; i < sets.size(); ++i)
        EXPECT_TRUE(same_bits(frame(sets[i]), first)) << n << " rows, " << h << " units";
    }
}

TEST(FusedOps, AttentionPoolIsItsReference) {
  for (const int64_t d : {1, 6, 33})
    expect_fused(
        {random({9, 5, d}, 1), random({9, 5, d}, 2)},
        [](Args x) { return attention_pool(x[0], x[1], 0.4); },
        [](Args x) { return attention_pool_reference(x[0], x[1], 0.4); });
}

/// Rows of random numbers that differ by `spread`.
Tensor alike(const Shape& shape, uint64_t seed, double spread) {
  Tensor x = random(shape, seed);
  const int64_t d = shape[-1];
  for (int64_t i = d; i < x.numel(); ++i) x.data<double>()[i] = x.item(i % d) + spread * x.item(i);
  return x;
}

/// Points and features that differ by `spread`, and weights.
std::vector<Tensor> attention(const Shape& rows, double spread) {
  const int64_t d = rows[-1];
  return {alike({rows[0], rows[1], 3}, 1, spread),
          alike(rows, 2, spread),
          alike(rows, 3, spread),
          random(rows, 4),
          random({d, 3}, 5),
          random({d}, 6, 0.01),
          random({2 * d, d}, 7),
          random({d, d}, 8),
          random({d}, 9)};
}
Var attend(Args x, const Tensor& index, bool dense = false) {
  return neighbour_attention({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]}, index, 0.05,
                             dense);
}
Var attend_reference(Args x, const Tensor& index) {
  return neighbour_attention_reference({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]},
                                       index, 0.05);
}

TEST(FusedOps, NeighbourAttentionIsItsReference) {
  for (const double spread : {1.0, 0.02, 1e-4}) {  // most units active, some, none
    const std::vector<Tensor> inputs = attention({2, 200, 33}, spread);
    const Tensor index = knn(inputs[0], inputs[0], 5);
    for (const bool dense : {false, true}) {
      take_kernel_stats();
      expect_fused(
          inputs, [&](Args x) { return attend(x, index, dense); },
          [&](Args x) { return attend_reference(x, index); });
      const KernelStats stats = take_kernel_stats();
      EXPECT_EQ(stats.active_share < 0.5, !dense && spread < 1);
      EXPECT_EQ(stats.active_score_share < 0.5, !dense && spread < 1);
    }
  }
}

TEST(FusedOps, NeighbourAttentionsBackwardMakesNoSubnormals) {
  // Products of them are many times slower, and a softmax that is all for one neighbour is full of
  // them. How many there are depends on the scale of the scores.
  const std::vector<Tensor> inputs = attention({1, 60, 33}, 1);
  Tensor index = Tensor::zeros({1, 60, 2}, DType::i32);  // itself, and the first
  for (int32_t i = 0; i < 60; ++i) index.data<int32_t>()[2 * i] = i;
  const float smallest = std::numeric_limits<float>::min();
  for (const double scale : {10., 30.}) {
    Tape tape;
    std::vector<Var> x;
    for (const Tensor& t : inputs) x.push_back(tape.leaf(t.cast(DType::f32), x.size() + 1));
    const Var y =
        neighbour_attention({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]}, index, scale);
    const Gradients gradients = tape.backward(sum_all(square(y)) * 1e-5);
    for (const uint64_t id : {2, 3, 4})  // query, key, value
      for (const float g : gradients.find(id)->to_vector<float>())
        EXPECT_TRUE(g == 0 || std::fabs(g) >= smallest) << g << ", input " << id << ", " << scale;
  }
  const volatile float small = smallest / 4;
  EXPECT_GT(small * 1.0f, 0.0f) << "the caller's thread goes on as it was";
}

TEST(FusedOps, NeighbourAttentionShowsWhatIsNotFinite) {
  const std::vector<Tensor> inputs = attention({1, 60, 33}, 1e-4);
  const Tensor index = knn(inputs[0], inputs[0], 5);
  for (size_t k = 0; k + 1 < inputs.size(); ++k)  // the last, g, is not seen by the softmax
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
      std::vector<Tensor> x = inputs;
      x[k] = x[k].clone();
      x[k].data<double>()[x[k].numel() / 2] = bad;
      const std::vector<Var> a(x.begin(), x.end());
      const auto finite = [](const Var& y) {
        double sum = 0;
        for (const double e : y.value.to_vector<double>()) sum += e;
        return std::isfinite(sum);
      };
      EXPECT_TRUE(finite(attend_reference(a, index)) || !finite(attend(a, index)))
          << "input " << k << " with " << bad;
    }
}

TEST(FusedOps, LinearWithReluIsMatmulPlusBiasAndRelu) {
  expect_fused(
      {random({5, 3, 7}, 1), random({11, 7}, 2), random({11}, 3)},
      [](Args x) { return linear(x[0], x[1], x[2], Activation::relu); },
      [](Args x) {
        const Var flat = reshape(x[0], {15, 7});
        return reshape(relu(matmul(flat, x[1], false, true) + x[2]), {5, 3, 11});
      });
}

/// (x - mean) / sqrt(variance + eps) along `axis`, from elementary ops.
Var normalised(const Var& x, int axis, double eps) {
  Shape kept = x.shape();
  kept.set(axis, 1);
  const Var centred = x - reshape(mean(x, axis), kept);
  const Var variance = reshape(mean(square(centred), axis), kept);
  return centred / sqrt(add_scalar(variance, eps));
}

TEST(FusedOps, NormsAreTheirFormulas) {
  expect_fused(
      {random({6, 5}, 1), random({5}, 2), random({5}, 3)},
      [](Args x) { return layer_norm(x[0], x[1], x[2]); },
      [](Args x) { return normalised(x[0], 1, 1e-5) * x[1] + x[2]; });
  expect_fused(
      {random({600, 3}, 1), random({3}, 2), random({3}, 3)},
      [](Args x) { return batch_norm(x[0], x[1], x[2], 1e-3); },
      [](Args x) { return normalised(x[0], 0, 1e-3) * x[1] + x[2]; });
  expect_fused(
      {random({3, 520, 4}, 1)}, [](Args x) { return instance_norm(x[0]); },
      [](Args x) { return normalised(x[0], 1, 1e-5); });
}

TEST(FusedOps, BatchNormReportsItsStatistics) {
  const Tensor x = Tensor::from<double>({4, 2}, {1, 10, 2, 10, 3, 10, 6, 10});
  BatchStatistics s;
  batch_norm(Var(x), Var(Tensor::full({2}, 1, DType::f64)), Var(Tensor::zeros({2}, DType::f64)),
             1e-5, &s);
  EXPECT_EQ(s.count, 4);
  EXPECT_DOUBLE_EQ(s.mean.item(0), 3);
  EXPECT_NEAR(s.variance.item(0), 3.5, 1e-12);
  EXPECT_DOUBLE_EQ(s.mean.item(1), 10);
  EXPECT_NEAR(s.variance.item(1), 0, 1e-12);
}

/// x [n, v, i] around `centre`, W [o, i], b, scale and shift.
std::vector<Tensor> trunk(int64_t n, int64_t v, int64_t i, int64_t o, double centre) {
  const Tensor x = add_scalar(Var(random({n, v, i}, 1)), centre).value;
  return {x, random({o, i}, 2), random({o}, 3), random({o}, 4, 0.1), random({o}, 5)};
}

TEST(FusedOps, PooledNormIsItsReference) {
  for (const Activation act : {Activation::none, Activation::relu})
    for (const auto& [n, v, i, o] :
         {std::array<int64_t, 4>{1, 9, 2, 3}, {3, 40, 7, 70}, {2, 700, 300, 33}})
      expect_fused(
          trunk(n, v, i, o, 3),
          [=](Args x) { return pooled_norm(x[0], x[1], x[2], x[3], x[4], act, 1e-3); },
          [=](Args x) { return pooled_norm_reference(x[0], x[1], x[2], x[3], x[4], act, 1e-3); });
}

TEST(FusedOps, ModulateIsItsReference) {
  for (const Activation act : {Activation::none, Activation::relu})
    for (const auto& [n, rows, v, c] :
         {std::array<int64_t, 4>{1, 3, 3, 2}, {3, 1, 40, 33}, {2, 300, 300, 70}, {2, 1, 290, 16}})
      expect_fused(
          {random({n, rows, c}, 1), random({n, v, 3}, 2), random({c, 3}, 3), random({c}, 4),
           random({c, 3}, 5), random({c}, 6)},
          [=](Args x) { return modulate(x[0], x[1], x[2], x[3], x[4], x[5], act); },
          [=](Args x) { return modulate_reference(x[0], x[1], x[2], x[3], x[4], x[5], act); });
}

TEST(FusedOps, ElainIsItsReference) {
  for (const double slope : {1.0, 0.2})
    for (const auto& [n, v, c] :
         {std::array<int64_t, 3>{1, 3, 2}, {3, 40, 33}, {2, 300, 70}, {2, 290, 16}})
      expect_fused(
          {random({n, v, c}, 1), random({n, v, c}, 2), random({n, v, c}, 3), random({n, v, c}, 4),
           random({n, c}, 5)},
          [=](Args x) { return elain(x[0], x[1], x[2], x[3], x[4], slope); },
          [=](Args x) { return elain_reference(x[0], x[1], x[2], x[3], x[4], slope); });
}

TEST(FusedOps, SinkhornIsItsReference) {
  for (const int steps : {1, 5, 9})
    for (const auto& [n, v, p] :
         {std::array<int64_t, 3>{1, 1, 1}, {2, 7, 5}, {1, 300, 280}, {3, 40, 70}})
      expect_fused(
          {exp(Var(random({n, v, p}, 1))).value},
          [=](Args x) { return sinkhorn(x[0], steps, 1e-3); },
          [=](Args x) { return sinkhorn_reference(x[0], steps, 1e-3); });
}

TEST(FusedOps, PooledNormReportsTheStatisticsOfItsReference) {
  std::vector<Var> x;
  for (const Tensor& t : trunk(3, 50, 6, 40, 20)) x.emplace_back(t);
  BatchStatistics a, b;
  pooled_norm(x[0], x[1], x[2], x[3], x[4], Activation::relu, 1e-5, &a);
  pooled_norm_reference(x[0], x[1], x[2], x[3], x[4], Activation::relu, 1e-5, &b);
  EXPECT_EQ(a.count, 150);
  EXPECT_EQ(a.count, b.count);
  expect_near(a.mean, b.mean, 1e-12, "mean");
  expect_near(a.variance, b.variance, 1e-12, "variance");
}

TEST(FusedOps, PooledNormShowsWhatIsNotFinite) {
  const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity()};
  for (size_t k = 0; k < 5; ++k)
    for (const double value : bad) {
      std::vector<Tensor> inputs = trunk(2, 5, 3, 4, 0);
      inputs[k].data<double>()[0] = value;
      const std::vector<Var> x(inputs.begin(), inputs.end());
      const Tensor y = pooled_norm(x[0], x[1], x[2], x[3], x[4], Activation::relu).value;
      const Tensor r = pooled_norm_reference(x[0], x[1], x[2], x[3], x[4], Activation::relu).value;
      for (int64_t i = 0; i < y.numel(); ++i)
        EXPECT_EQ(std::isfinite(y.item(i)), std::isfinite(r.item(i))) << k << " " << i;
    }
}

TEST(FusedOps, Conv1dIsTheSumOverItsWindow) {
  const int64_t n = 2, l = 9, c = 3, o = 4, k = 5, stride = 2, pad = 3, steps = 6;
  const Tensor x = random({n, l, c}, 1), w = random({o, c, k}, 2), b = random({o}, 3);
  const Tensor y = conv1d(Var(x), Var(w), Var(b), stride, pad, steps).value;
  for (int64_t i = 0; i < n; ++i)
    for (int64_t s = 0; s < steps; ++s)
      for (int64_t q = 0; q < o; ++q) {
        double sum = b.item(q);
        for (int64_t j = 0; j < k; ++j) {
          const int64_t at = s * stride - pad + j;
          for (int64_t p = 0; at >= 0 && at < l && p < c; ++p)
            sum += x.item((i * l + at) * c + p) * w.item((q * c + p) * k + j);
        }
        EXPECT_NEAR(y.item((i * steps + s) * o + q), sum, 1e-12);
      }
}

}  // namespace
}  // namespace restage
