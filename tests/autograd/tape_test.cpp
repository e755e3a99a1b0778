#include "autograd/tape/tape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

Tensor values(const std::vector<double>& v) {
  return Tensor::from<double>({static_cast<int64_t>(v.size())}, v);
}

/// What the error of type E says; fails if there is none.
template <class E, class F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const E& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << "'" << word << "' is not in: " << text;
}

TEST(Tape, RecordsOnlyWhatDependsOnALeaf) {
  const Var a(values({1, 2})), b(values({3, 4}));
  EXPECT_EQ((a + b).tape, nullptr);
  Tape tape;
  EXPECT_EQ(tape.size(), 0u);
  const Var x = tape.leaf(values({5, 6}), 1);
  EXPECT_EQ(tape.size(), 1u);
  const Var constant = a * b;
  EXPECT_EQ(tape.size(), 1u);
  const Var y = x * constant;
  EXPECT_EQ(tape.size(), 2u);
  EXPECT_EQ((y.detach() * a).tape, nullptr);
  EXPECT_EQ(tape.size(), 2u);
}

TEST(Tape, TheSameLeafTwiceIsOneNode) {
  Tape tape;
  const Tensor w = values({2});
  const Var first = tape.leaf(w, 9), second = tape.leaf(w, 9);
  EXPECT_EQ(first.node, second.node);
  EXPECT_EQ(tape.size(), 1u);
  const Gradients g = tape.backward(sum_all(first * second));
  EXPECT_DOUBLE_EQ(g.find(9)->item(), 4);
}

TEST(Tape, GradientsAreAValueAndDoNotAddUpBetweenPasses) {
  const Tensor w = values({2, 3});
  const auto pass = [&] {
    Tape tape;
    return tape.backward(sum_all(square(tape.leaf(w, 1))));
  };
  const Gradients first = pass(), second = pass();
  for (const Gradients& g : {first, second}) {
    EXPECT_DOUBLE_EQ(g.find(1)->item(0), 4);
    EXPECT_DOUBLE_EQ(g.find(1)->item(1), 6);
  }
  EXPECT_DOUBLE_EQ(first.norm(), std::sqrt(52.0));
}

TEST(Tape, AnUnusedLeafHasNoGradient) {
  Tape tape;
  const Var used = tape.leaf(values({1}), 1), unused = tape.leaf(values({1}), 2);
  const Gradients g = tape.backward(sum_all(exp(used)));
  EXPECT_NE(g.find(1), nullptr);
  EXPECT_EQ(g.find(2), nullptr);
  EXPECT_EQ(g.find(3), nullptr);
}

TEST(Tape, ADiamondAddsBothPaths) {
  Tape tape;
  const Var x = tape.leaf(values({0.5}), 1);
  const Var left = exp(x), right = square(x);
  const Gradients g = tape.backward(sum_all(left * right + right));
  const double e = std::exp(0.5);
  EXPECT_NEAR(g.find(1)->item(), e * 0.25 + e * 1.0 + 1.0, 1e-14);
}

TEST(Tape, AccumulationDoesNotChangeASharedGradient) {
  // add() hands the same tensor to both inputs; adding to one must not change the other.
  Tape tape;
  const Var x = tape.leaf(values({1}), 1), y = tape.leaf(values({1}), 2);
  const Gradients g = tape.backward(sum_all(scale(x, 3) + (x + y)));
  EXPECT_DOUBLE_EQ(g.find(1)->item(), 4);
  EXPECT_DOUBLE_EQ(g.find(2)->item(), 1);
}

TEST(Tape, TwoPlayersDoNotMix) {
  // The discriminator's step sees the generator's output as a constant.
  const Tensor generator = values({2}), discriminator = values({3});
  Tape g_tape;
  const Var fake = g_tape.leaf(generator, 1) * Var(values({5}));
  Tape d_tape;
  const Gradients d = d_tape.backward(sum_all(d_tape.leaf(discriminator, 2) * fake.detach()));
  EXPECT_EQ(d.find(1), nullptr);
  EXPECT_DOUBLE_EQ(d.find(2)->item(), 10);
  const Gradients g = g_tape.backward(sum_all(fake * Var(discriminator)));
  EXPECT_DOUBLE_EQ(g.find(1)->item(), 15);
  EXPECT_EQ(g.find(2), nullptr);
}

TEST(Tape, RefusesValuesOfTwoTapes) {
  Tape a, b;
  const Var x = a.leaf(values({1}), 1), y = b.leaf(values({1}), 2);
  expect_words(message_of<Error>([&] { x + y; }), {"two tapes"});
  expect_words(message_of<Error>([&] { a.backward(sum_all(y)); }), {"this tape"});
}

TEST(Tape, RefusesABackwardOfManyNumbersOrOfAConstant) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2}), 1);
  expect_words(message_of<ShapeError>([&] { tape.backward(exp(x)); }), {"[2]", "not one number"});
  expect_words(message_of<Error>([&] { tape.backward(Var(values({1}))); }), {"does not depend"});
}

TEST(Tape, RefusesStaleValues) {
  Tape tape;
  const Var x = tape.leaf(values({1}), 1);
  const Var y = exp(x), loss = sum_all(y);
  tape.backward(loss);
  EXPECT_EQ(tape.size(), 0u);
  expect_words(message_of<Error>([&] { tape.backward(loss); }), {"consumed"});
  expect_words(message_of<Error>([&] { exp(y); }), {"consumed"});
  // A new leaf of the same tape is not mistaken for the old one.
  const Var fresh = tape.leaf(values({3}), 1);
  expect_words(message_of<Error>([&] { fresh + x; }), {"consumed"});
  EXPECT_DOUBLE_EQ(tape.backward(sum_all(square(fresh))).find(1)->item(), 6);
}

TEST(Tape, DeepChainsNeitherRecurseNorOverflow) {
  Tape tape;
  Var x = tape.leaf(values({1}), 1);
  for (int i = 0; i < 200000; ++i) x = add_scalar(x, 1e-6);
  EXPECT_DOUBLE_EQ(tape.backward(sum_all(x)).find(1)->item(), 1);
}

struct Seventeen {
  static constexpr const char* name = "seventeen";
  static constexpr const char* letters = "x_i[1]";
  void check(Inputs) const {}
  Tensor forward(Inputs x, Saved&) const { return x[0].clone(); }
  Grads backward(const Saved&, const Tensor& gy, Needs needs) const {
    return Grads(needs.size(), gy);
  }
};

TEST(Tape, RefusesMoreInputsThanItHasRoomFor) {
  Tape tape;
  const std::vector<Var> many(17, tape.leaf(values({1}), 1));
  expect_words(message_of<Error>([&] { call(Seventeen{}, std::span<const Var>(many)); }),
               {"seventeen", "16"});
}

TEST(ModulePath, NamesTheInnermostPart) {
  EXPECT_EQ(module_path(), "(no module)");
  {
    const ModuleScope a("smrm");
    {
      const ModuleScope b("enc"), nothing(""), c("gru");
      EXPECT_EQ(module_path(), "smrm.enc.gru");
    }
    EXPECT_EQ(module_path(), "smrm");
  }
  EXPECT_EQ(module_path(), "(no module)");
}

TEST(ShapeErrors, NameOpLettersShapesAndModule) {
  const ModuleScope scope("skeleton.fc1");
  const Var x(Tensor::zeros({2, 3}, DType::f64)), w(Tensor::zeros({4, 5}, DType::f64)),
      b(Tensor::zeros({4}, DType::f64));
  expect_words(message_of<ShapeError>([&] { linear(x, w, b); }),
               {"linear", "x[..., i], W[o, i], b[o]", "i must agree", "[2, 3] float64",
                "[4, 5] float64", "[4] float64", "skeleton.fc1"});
}

TEST(FiniteChecks, NameTheOpAndModuleOfTheForwardPass) {
  const Var x(values({1, 0}));
  EXPECT_TRUE(std::isinf(log(x).value.item(1)));  // silent without the check
  const FiniteCheck check;
  const ModuleScope outer("deformation"), inner("fc2");
  const std::string what = message_of<NonFiniteError>([&] { log(x); });
  expect_words(what, {"forward", "'log'", "deformation.fc2"});
}

TEST(FiniteChecks, NameTheOpAndModuleOfTheBackwardPass) {
  const FiniteCheck check;
  Tape tape;
  Var y;
  {
    const ModuleScope scope("smrm.out");
    y = sqrt(tape.leaf(values({0}), 1));  // finite, with an infinite derivative
  }
  const std::string what = message_of<NonFiniteError>([&] { tape.backward(sum_all(y)); });
  expect_words(what, {"backward", "'sqrt'", "smrm.out"});
}

TEST(FiniteChecks, EndWithTheirScope) {
  { const FiniteCheck check; }
  EXPECT_FALSE(FiniteCheck::active());
  EXPECT_NO_THROW(log(Var(values({0}))));
}

TEST(FiniteChecks, NothingHidesNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Tensor x = Tensor::from<double>({1, 2}, {nan, 1});
  EXPECT_TRUE(std::isnan(relu(Var(x)).value.item(0)));
  EXPECT_TRUE(std::isnan(abs(Var(x)).value.item(0)));
  EXPECT_TRUE(std::isnan(softplus(Var(x)).value.item(0)));
  EXPECT_TRUE(std::isnan(sigmoid(Var(x)).value.item(0)));
  EXPECT_TRUE(std::isnan(tanh(Var(x)).value.item(0)));
  EXPECT_TRUE(std::isnan(max(Var(x), 1).value.item()));
  EXPECT_TRUE(std::isnan(max(Var(values({1, nan, 2})), 0).value.item()));
  EXPECT_TRUE(std::isnan(softmax(Var(x), 1).value.item(1)));
  const Var w(Tensor::full({1, 2}, 1, DType::f64)), b(Tensor::zeros({1}, DType::f64));
  EXPECT_TRUE(std::isnan(linear(Var(x), w, b, Activation::relu).value.item()));
  Gradients g;
  g.set(1, x);
  EXPECT_FALSE(g.finite());
}

}  // namespace
}  // namespace restage
