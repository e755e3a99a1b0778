// Products in bfloat16: how operands are rounded, in which order they are summed, and that the
// matrix unit and the vector instructions of every set agree to the last bit.
#include "autograd/kernels/matmul_precision.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "autograd/base/error.h"
#include "autograd/gradcheck/evaluate.h"
#include "autograd/kernels/matmul.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"
#include "autograd/tensor/nan_memory.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

using gradcheck::random;
using gradcheck::same_bits;
using testing::UseSet;

constexpr auto kBf16 = MatmulPrecision::bfloat16;
const float kInf = HUGE_VALF, kNan = std::nanf("");

Tensor floats(const Shape& shape, uint64_t stream) {
  return random(shape, stream).cast(DType::f32);
}

/// To 8 bits of significand, to nearest, ties to even.
double to_bfloat16(double x) {
  if (x == 0 || !std::isfinite(x)) return x;
  int e = 0;
  const double fraction = std::frexp(x, &e), y = std::ldexp(std::nearbyint(fraction * 256), e - 8);
  return std::abs(y) > 3.4e38 ? std::copysign(HUGE_VAL, x) : y;
}

struct UseUnit {
  bool before = matrix_unit();
  explicit UseUnit(bool use) { use_matrix_unit(use); }
  ~UseUnit() { use_matrix_unit(before); }
};

/// A product as the kernel gets it.
struct Case {
  Tensor a, b, bias, start;  ///< start: accumulated onto, if defined
  bool ta = false, tb = false, relu = false;

  Tensor run(MatmulPrecision precision = kBf16) const {
    const NanMemory unwritten_shows;
    Shape shape;
    if (a.rank() == 3 || b.rank() == 3) shape.push_back(a.rank() == 3 ? a.size(0) : b.size(0));
    shape.push_back(a.size(ta ? -1 : -2));
    shape.push_back(b.size(tb ? -2 : -1));
    Tensor out = start.defined() ? start.clone() : Tensor::empty(shape, a.dtype());
    MatmulArgs args{a,
                    b,
                    out,
                    ta,
                    tb,
                    bias.defined() ? &bias : nullptr,
                    relu ? Activation::relu : Activation::none,
                    start.defined()};
    args.precision = precision;
    launch(args);
    return out;
  }
  std::string str() const {
    return a.shape().str() + (ta ? "^T " : " ") + b.shape().str() + (tb ? "^T" : "") +
           (bias.defined() ? " bias" : "") + (relu ? " relu" : "") +
           (start.defined() ? " accumulate" : "");
  }
  int64_t terms() const { return a.size(ta ? -2 : -1); }
  static double at(const Tensor& t, int64_t s, int64_t i, int64_t j, bool transpose) {
    const int64_t rows = t.size(-2), cols = t.size(-1), begin = t.rank() == 3 ? s * rows * cols : 0;
    return to_bfloat16(t.item(begin + (transpose ? j * cols + i : i * cols + j)));
  }
  /// The element (i, j) of product s before bias and activation, by `f(l -> terms)`.
  double exact(int64_t s, int64_t i, int64_t j, double from) const {
    for (int64_t l = 0; l < terms(); ++l) from += at(a, s, i, l, ta) * at(b, s, l, j, tb);
    return from;
  }
  /// The same as kernels/matmul.h describes it, in float32.
  float in_order(int64_t s, int64_t i, int64_t j, float from) const {
    for (int64_t step = 0; step < terms(); step += 32) {
      float sums[2] = {0, 0};
      for (int64_t l = step; l < std::min(terms(), step + 32); ++l)
        sums[l % 2] = std::fma(static_cast<float>(at(a, s, i, l, ta)),
                               static_cast<float>(at(b, s, l, j, tb)), sums[l % 2]);
      from += sums[0] + sums[1];
    }
    return from;
  }
};

Tensor matrix(int64_t batch, int64_t rows, int64_t cols, bool transpose, uint64_t stream) {
  if (transpose) std::swap(rows, cols);
  return batch < 0 ? floats({rows, cols}, stream) : floats({batch, rows, cols}, stream);
}

/// Every way to call, every remainder of panels, steps, passes and tiles.
std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&](int64_t m, int64_t k, int64_t n, bool ta, bool tb, int64_t ba = -1,
                       int64_t bb = -1) {
    Case c;
    c.a = matrix(ba, m, k, ta, 1);
    c.b = matrix(bb, k, n, tb, 2);
    c.ta = ta;
    c.tb = tb;
    all.push_back(c);
    c.bias = floats({n}, 3);
    c.relu = all.size() % 4 != 0;
    if (all.size() % 3 == 0) c.start = floats(c.run(MatmulPrecision::float32).shape(), 4);
    all.push_back(c);
  };
  for (const bool ta : {false, true})
    for (const bool tb : {false, true}) {
      for (const int64_t m : {1, 2, 3, 5, 16, 33, 70})
        for (const int64_t n : {1, 4, 16, 17, 40})
          for (const int64_t k : {32, 33, 69, 130}) add(m, k, n, ta, tb);
      add(310, 300, 530, ta, tb);
      add(1100, 64, 40, ta, tb);
      add(40, 1100, 48, ta, tb);
      add(96, 5000, 300, ta, tb);
      add(70, 40, 33, ta, tb, 3, 3);
      add(70, 40, 33, ta, tb, -1, 3);
      add(70, 40, 33, ta, tb, 3, -1);
    }
  return all;
}

TEST(MatmulPrecision, IsFloat32UntilSomebodyAsksForLess) {
  EXPECT_EQ(matmul_precision(), MatmulPrecision::float32);
  const Tensor a = floats({50, 70}, 1), b = floats({70, 30}, 2);
  const Tensor before = matmul(Var(a), Var(b)).value;
  Tensor during;
  {
    const MatmulPrecisionScope scope(kBf16);
    EXPECT_EQ(matmul_precision(), kBf16);
    during = matmul(Var(a), Var(b)).value;
  }
  EXPECT_EQ(matmul_precision(), MatmulPrecision::float32);
  EXPECT_FALSE(same_bits(during, before));
  EXPECT_TRUE(same_bits(matmul(Var(a), Var(b)).value, before));
}

TEST(MatmulPrecision, ShortSumsAndFloat64StayAsTheyAre) {
  for (const Case& c : {Case{floats({40, 31}, 1), floats({31, 50}, 2), {}, {}},
                        Case{random({40, 64}, 1), random({64, 50}, 2), {}, {}},
                        Case{floats({40, 0}, 1), floats({0, 50}, 2), {}, {}}})
    EXPECT_TRUE(same_bits(c.run(kBf16), c.run(MatmulPrecision::float32))) << c.str();
}

TEST(MatmulPrecision, OperandsAreRoundedToNearestEven) {
  std::vector<float> numbers = {
      0.0f,    -0.0f, 1.0f, kInf, -kInf, kNan, 3e38f, -3e38f, 3.4e38f /* rounds up to infinity */,
      -3.4e38f};
  // Half way between two neighbours, beside it, and one step on, at even and odd ones.
  for (const uint32_t upper : {0x3f80u, 0x3f81u, 0x7f7eu, 0x7f7fu, 0x0080u, 0xc2ffu, 0xbf7fu})
    for (const uint32_t lower : {0x0u, 0x1u, 0x7fffu, 0x8000u, 0x8001u, 0xffffu})
      numbers.push_back(std::bit_cast<float>(upper << 16 | lower));
  Rng rng(RngKey{8, 16});
  while (numbers.size() < 3000) {
    const float x = std::bit_cast<float>(static_cast<uint32_t>(rng.below(uint64_t{1} << 32)));
    if (!std::isfinite(x) || std::abs(x) >= 1.2e-38f) numbers.push_back(x);
  }
  const auto count = static_cast<int64_t>(numbers.size());
  Tensor first = Tensor::full({count, 32}, 0), one = Tensor::full({1, 32}, 0);
  one.data<float>()[0] = 1;
  for (int64_t i = 0; i < count; ++i) first.data<float>()[i * 32] = numbers[static_cast<size_t>(i)];
  Tensor turned = Tensor::empty({32, count}, DType::f32);
  for (int64_t i = 0; i < count; ++i)
    for (int64_t l = 0; l < 32; ++l)
      turned.data<float>()[l * count + i] = first.data<float>()[i * 32 + l];
  Case as_a{first, one, {}, {}}, as_b{one, first, {}, {}}, a_turned{turned, one, {}, {}},
      b_turned{one, turned, {}, {}};
  as_a.tb = as_b.tb = a_turned.ta = a_turned.tb = true;
  for (const Case& c : {as_a, as_b, a_turned, b_turned}) {
    const Tensor out = c.run();
    for (int64_t i = 0; i < count; ++i) {
      const float x = numbers[static_cast<size_t>(i)];
      const double want = to_bfloat16(x), got = out.item(i);
      ASSERT_TRUE(want == got || (std::isnan(x) && std::isnan(got)))
          << c.str() << " " << x << ": " << got << ", not " << want;
    }
  }
}

TEST(MatmulPrecision, ProductsAreThoseOfRoundedOperands) {
  for (const Case& c : cases()) {
    const Tensor out = c.run();
    const int64_t m = out.size(-2), n = out.size(-1), batch = out.numel() / (m * n);
    const double tolerance = 2e-6 * std::sqrt(static_cast<double>(c.terms()));
    for (int64_t s = 0; s < batch; ++s)
      for (int64_t i = 0; i<m; i += m> 100 ? 37 : 1)
        for (int64_t j = 0; j<n; j += n> 100 ? 23 : 1) {
          const int64_t at = (s * m + i) * n + j;
          double want = c.exact(s, i, j, c.start.defined() ? c.start.item(at) : 0);
          if (c.bias.defined()) want += c.bias.item(j);
          if (c.relu) want = std::max(want, 0.0);
          ASSERT_NEAR(out.item(at), want, tolerance) << c.str() << " at " << i << ", " << j;
        }
  }
}

/// Calls f(title) for all ways to compute.
template <class F>
void with_all_means(const F& f) {
  for (const std::string& set : instruction_sets())
    for (const bool unit : {false, true}) {
      if (unit && !has_matrix_unit()) continue;
      const UseSet use(set);
      const UseUnit use_unit(unit);
      f(set + (unit ? " with the matrix unit" : ""));
    }
}

TEST(MatmulPrecision, TheOrderOfTheSumIsThatOfTheContractOnEveryProcessor) {
  for (const Case& c : cases()) {
    if (c.bias.defined()) continue;
    with_all_means([&](const std::string& means) {
      const Tensor out = c.run();
      const int64_t m = out.size(-2), n = out.size(-1);
      for (int64_t at = 0; at<out.numel(); at += out.numel()> 2000 ? 1009 : 1) {
        const int64_t s = at / (m * n), i = at / n % m, j = at % n;
        const float start = c.start.defined() ? c.start.data<float>()[at] : 0.0f;
        ASSERT_EQ(out.data<float>()[at], c.in_order(s, i, j, start)) << means << ", " << c.str();
      }
    });
  }
}

TEST(MatmulPrecision, AllMeansAndThreadsGiveTheSameBits) {
  for (const Case& c : cases()) {
    const Tensor first = c.run();
    with_all_means([&](const std::string& means) {
      EXPECT_TRUE(same_bits(c.run(), first)) << means << ", " << c.str();
    });
    for (const int n : {1, 2, 3}) {
      const testing::UseThreads use(n);
      EXPECT_TRUE(same_bits(c.run(), first)) << n << " threads, " << c.str();
    }
  }
}

/// Numbers of any bits, tiny ones and special ones in plenty.
Tensor wild(const Shape& shape, uint64_t stream) {
  const float special[] = {0.0f, -0.0f, kInf, -kInf, kNan, 1e-40f, -1e-45f, 1.2e-38f, 3e38f, 1.0f};
  Rng rng(RngKey{8, 17}.fold(stream));
  Tensor t = Tensor::empty(shape, DType::f32);
  for (int64_t i = 0; i < t.numel(); ++i) {
    const uint64_t kind = rng.below(40);
    auto bits = static_cast<uint32_t>(rng.below(uint64_t{1} << 32));
    if (kind > 4) bits = (bits & 0x807fffff) | static_cast<uint32_t>(20 + rng.below(100)) << 23;
    t.data<float>()[i] =
        kind == 0 && stream > 2 ? special[rng.below(10)] : std::bit_cast<float>(bits);
  }
  return t;
}

TEST(MatmulPrecision, TheMatrixUnitAgreesInTheCornersToo) {
  if (!has_matrix_unit()) GTEST_SKIP() << "this processor has no matrix unit for bfloat16 (AMX)";
  for (const std::string& set : testing::vector_sets())
    for (uint64_t stream = 1; stream < 60; ++stream) {
      Case c{wild({33, 70}, stream), wild({70, 40}, stream + 100), {}, {}};
      if (stream % 2) c.start = wild({33, 40}, stream + 200);
      const Tensor unit = c.run();
      const UseSet use(set);
      const UseUnit off(false);
      const Tensor vectors = c.run();
      EXPECT_TRUE(same_bits(unit, vectors)) << set << ", stream " << stream;
      int64_t finite = 0, none = 0;
      for (int64_t i = 0; i < unit.numel(); ++i) {
        finite += std::isfinite(unit.item(i));
        none += std::isnan(unit.item(i));
      }
      EXPECT_GT(finite, 0);
      EXPECT_TRUE(stream <= 2 || none > 0);
    }
}

TEST(MatmulPrecision, SubnormalNumbersAreZero) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "only x86 can leave them out";
#endif
  Tensor a = Tensor::full({3, 32}, 0), b = Tensor::full({32, 1}, 0);
  const float tiny[] = {1e-39f, 2e-38f, 2e-38f}, by[] = {1e30f, 0.25f, 1};
  for (int64_t i = 0; i < 3; ++i) a.data<float>()[i * 32 + i] = tiny[i];
  for (int64_t i = 0; i < 3; ++i) b.data<float>()[i] = by[i];
  with_all_means([&](const std::string& means) {
    const Tensor out = Case{a, b, {}, {}}.run();
    EXPECT_EQ(out.item(0), 0) << means << ": an operand";
    EXPECT_EQ(out.item(1), 0) << means << ": a product";
    EXPECT_EQ(out.item(2), to_bfloat16(2e-38f)) << means;
  });
}

TEST(MatmulPrecision, GradientsOfALayerAreCloseToThoseOfFloat32) {
  const Tensor x = floats({300, 70}, 1), w = floats({90, 70}, 2), bias = floats({90}, 3);
  const auto run = [&](MatmulPrecision precision) {
    const MatmulPrecisionScope scope(precision);
    const gradcheck::Sample sample{
        "", {x, w, bias}, [](gradcheck::Args in) { return linear(in[0], in[1], in[2]); }};
    return gradcheck::evaluate(sample, floats({300, 90}, 4));
  };
  const gradcheck::Evaluation exact = run(MatmulPrecision::float32), rounded = run(kBf16);
  const auto distance = [](const Tensor& a, const Tensor& b) {
    double d = 0, norm = 0;
    for (int64_t i = 0; i < a.numel(); ++i) {
      d += std::pow(a.item(i) - b.item(i), 2);
      norm += std::pow(a.item(i), 2);
    }
    return std::sqrt(d / norm);
  };
  // Two operands off by 2^-9 at most each, so a relative error of some 2^-9.
  const auto expect_close = [&](const Tensor& a, const Tensor& b, const char* what) {
    EXPECT_GT(distance(a, b), 1e-4) << what << " was not rounded";
    EXPECT_LT(distance(a, b), 4e-3) << what;
  };
  expect_close(exact.value, rounded.value, "value");
  expect_close(exact.gradients[0], rounded.gradients[0], "gradient of the input");
  expect_close(exact.gradients[1], rounded.gradients[1], "gradient of the weights");
  EXPECT_TRUE(same_bits(exact.gradients[2], rounded.gradients[2])) << "the bias is no product";
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
    Tape tape;
    std::vector<Var> leaves;
    for (size_t k = 0; k < s.inputs.size(); ++k) leaves.push_back(tape.leaf(s.inputs[k], k + 1));
    Var y;
    {
      const MatmulPrecisionScope scope(kBf16);
      y = s.build(leaves);
    }
    const Tensor u = floats(y.shape(), 9);
    const Gradients late = tape.backward(sum_all(mul(y, Var(u))));
    const MatmulPrecisionScope scope(kBf16);
    const gradcheck::Evaluation all = gradcheck::evaluate(s, u);
    for (size_t k = 0; k < s.inputs.size(); ++k)
      EXPECT_TRUE(same_bits(*late.find(k + 1), all.gradients[k])) << s.title << " input " << k;
  }
}

TEST(MatmulPrecision, AMatrixUnitThatIsNotThereIsAnError) {
  if (has_matrix_unit()) GTEST_SKIP() << "this processor has one";
  EXPECT_FALSE(matrix_unit());
  EXPECT_THROW(use_matrix_unit(true), Error);
}

}  // namespace
}  // namespace restage
