// Every instruction set gives the same numbers: the vector ones bit for bit, the baseline (which
// has no fused multiply-add) up to rounding.
#include "autograd/kernels/instruction_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "autograd/base/error.h"
#include "autograd/gradcheck/evaluate.h"
#include "autograd/tensor/nan_memory.h"
#include "tests/support/use_set.h"

namespace restage::gradcheck {
namespace {

using testing::UseSet;
using testing::vector_sets;

/// Calls f(op, sample) for all samples that can be computed in float32, and a few random ones.
void for_samples(const std::function<void(const OpSamples&, const Sample&)>& f) {
  for (const OpSamples& op : all_samples()) {
    std::vector<Sample> samples = op.samples;
    Rng rng(RngKey{8, 1}.fold(op.op));
    for (int i = 0; op.random && i < 6; ++i) samples.push_back(op.random(rng));
    for (Sample s : samples) {
      if (s.kind == Sample::Kind::error) continue;
      for (Tensor& t : s.inputs) t = t.cast(DType::f32);
      f(op, s);
    }
  }
}

Evaluation with_set(const std::string& set, const Sample& s) {
  const UseSet use(set);
  const NanMemory unwritten_shows;
  return evaluate(s, random(value_of(s, s.inputs).shape(), 7).cast(DType::f32));
}

TEST(InstructionSets, AreNamedAndChosen) {
  const auto sets = instruction_sets();
  ASSERT_FALSE(sets.empty());
  EXPECT_EQ(sets.back(), "baseline");
  EXPECT_EQ(instruction_set(), sets.front()) << "the best is the default";
  for (const std::string& name : sets) {
    const UseSet use(name);
    EXPECT_EQ(instruction_set(), name);
  }
  EXPECT_EQ(instruction_set(), sets.front());
  EXPECT_THROW(use_instruction_set("abacus"), InputError);
}

TEST(InstructionSets, EveryOpHasTheSameBitsOnAllVectorSets) {
  const auto sets = vector_sets();
  if (sets.size() < 2) GTEST_SKIP() << "this processor has fewer than two vector sets";
  int64_t compared = 0;
  for_samples([&](const OpSamples& op, const Sample& s) {
    const Evaluation first = with_set(sets[0], s);
    for (size_t i = 1; i < sets.size(); ++i)
      EXPECT_TRUE(same_bits(first, with_set(sets[i], s)))
          << op.op << " " << s.title << ": " << sets[0] << " and " << sets[i];
    ++compared;
  });
  EXPECT_GT(compared, 300);
}

void expect_close(const Tensor& a, const Tensor& b, double tolerance, const std::string& what) {
  if (!a.defined()) return;
  double largest = 1;
  for (int64_t i = 0; i < a.numel(); ++i) largest = std::max(largest, std::abs(a.item(i)));
  for (int64_t i = 0; i < a.numel(); ++i) {
    const double x = a.item(i), y = b.item(i);
    ASSERT_TRUE(x == y || std::abs(x - y) <= tolerance * largest ||
                (std::isnan(x) && std::isnan(y)))
        << what << ": " << x << " and " << y;
  }
}

TEST(InstructionSets, TheBaselineIsCorrectToo) {
  const auto sets = instruction_sets();
  if (sets.size() < 2) GTEST_SKIP() << "this processor has only the baseline";
  for_samples([&](const OpSamples& op, const Sample& s) {
    const Evaluation best = with_set(sets.front(), s), base = with_set("baseline", s);
    expect_close(best.value, base.value, s.f32_tolerance, op.op + " " + s.title);
    for (size_t k = 0; k < best.gradients.size(); ++k)
      expect_close(best.gradients[k], base.gradients[k], s.f32_tolerance,
                   op.op + " " + s.title + ", gradient " + std::to_string(k));
  });
}

/// The numbers that functions are asked for: ordinary ones, tiny, huge and none.
Tensor arguments(DType type) {
  std::vector<double> x = {0.0,   -0.0,   HUGE_VAL, -HUGE_VAL, std::nan(""),
                           1e-30, -1e-30, 1e30,     -1e30};
  for (int i = -2000; i <= 2000; ++i) x.push_back(i * 0.05);
  for (int i = 0; i < 60; ++i) x.push_back(std::pow(2.0, -2 * i) * (i % 2 ? 1.37 : -1.11));
  Tensor t = Tensor::empty({static_cast<int64_t>(x.size())}, DType::f64);
  std::copy(x.begin(), x.end(), t.data<double>());
  return t.cast(type);
}

TEST(ElementaryFunctions, AreThoseOfTheStandardLibrary) {
  struct Case {
    const char* name;
    std::function<Var(const Var&)> ours;
    std::function<double(double)> theirs;
  };
  const std::vector<Case> cases = {
      {"exp", [](const Var& x) { return exp(x); }, [](double x) { return std::exp(x); }},
      {"log", [](const Var& x) { return log(x); }, [](double x) { return std::log(x); }},
      {"tanh", [](const Var& x) { return tanh(x); }, [](double x) { return std::tanh(x); }},
      {"sqrt", [](const Var& x) { return sqrt(x); }, [](double x) { return std::sqrt(x); }},
      {"sigmoid", [](const Var& x) { return sigmoid(x); },
       [](double x) { return 1 / (1 + std::exp(-x)); }},
      {"softplus", [](const Var& x) { return softplus(x); },
       [](double x) {
         return std::isnan(x) ? x : std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x)));
       }},
      {"relu", [](const Var& x) { return relu(x); }, [](double x) { return x <= 0 ? 0 : x; }}};
  for (const std::string& set : instruction_sets())
    for (const DType type : {DType::f32, DType::f64}) {
      const UseSet use(set);
      const bool narrow = type == DType::f32;
      const double tolerance = narrow ? 6e-7 : 2e-15, smallest = narrow ? 2e-38 : 1e-307;
      const Tensor x = arguments(type);
      for (const Case& c : cases) {
        const Tensor y = c.ours(Var(x)).value;
        for (int64_t i = 0; i < x.numel(); ++i) {
          const double exact = c.theirs(x.item(i));
          const double want = narrow ? static_cast<float>(exact) : exact, got = y.item(i);
          ASSERT_TRUE(want == got || (std::isnan(want) && std::isnan(got)) ||
                      std::abs(want - got) <= tolerance * std::abs(want) + smallest)
              << set << " " << c.name << "(" << x.item(i) << ") = " << got << ", not " << want;
        }
      }
    }
}

}  // namespace
}  // namespace restage::gradcheck
