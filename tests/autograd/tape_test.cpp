// The tape: what it records and gives back, and what it does not forgive: ops whose backward breaks
// its promises, values changed between the passes, and a second backward pass after a failed one.
#include "autograd/tape/tape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "autograd/kernels/update.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using test::expect_error;

Tensor values(const std::vector<double>& v) {
  return Tensor::from<double>({static_cast<int64_t>(v.size())}, v);
}

TEST(Tape, RecordsOnlyWhatDependsOnALeaf) {
  const Var a(values({1, 2})), b(values({3, 4}));
  EXPECT_FALSE((a + b).on_tape());
  Tape tape;
  EXPECT_EQ(tape.size(), 0u);
  const Var x = tape.leaf(values({5, 6}), 1);
  EXPECT_EQ(tape.size(), 1u);
  const Var constant = a * b;
  EXPECT_EQ(tape.size(), 1u);
  const Var y = x * constant;
  EXPECT_EQ(tape.size(), 2u);
  EXPECT_FALSE((y.detach() * a).on_tape());
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

TEST(Tape, ASliceAddsToItsPartAlone) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2, 3}), 1), y = tape.leaf(values({4, 5, 6}), 2);
  const Var middle = slice(x, 0, 1, 2), last = slice(x, 0, 1, 3);
  const Var both = x + y;  // comes first on the way back: x and y share one gradient
  const Gradients g = tape.backward(sum_all(concat({both, middle, middle * last}, 0)));
  EXPECT_EQ(g.find(1)->to_vector<double>(), (std::vector<double>{1, 1 + 1 + 2 + 5, 1 + 2}));
  EXPECT_EQ(g.find(2)->to_vector<double>(), (std::vector<double>{1, 1, 1}));
}

TEST(Tape, AnOpMayHaveSeveralResults) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2, 3, 4, 5, 6}), 1);
  const Vars parts = split(x, 0, {1, 2, 3});
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[1].value.to_vector<double>(), (std::vector<double>{2, 3}));
  ASSERT_EQ(tape.size(), 4u);
  EXPECT_STREQ(tape.name(1), "split");
  EXPECT_STREQ(tape.name(3), "another result");
  EXPECT_EQ(tape.saved(3), nullptr);
  tape.keep_gradient(parts[1]);
  tape.keep_gradient(parts[2]);
  const Gradients g = tape.backward(sum_all(square(parts[2])) + sum_all(parts[0]));
  EXPECT_EQ(g.size(), 1u);
  EXPECT_EQ(g.find(1)->to_vector<double>(), (std::vector<double>{1, 0, 0, 8, 10, 12}));
  EXPECT_EQ(g.find(parts[2])->to_vector<double>(), (std::vector<double>{8, 10, 12}));
  EXPECT_EQ(g.find(parts[1]), nullptr) << "the loss does not depend on it";
  const Vars constants = split(x.detach(), 0, {3, 3});
  EXPECT_FALSE(constants[1].on_tape());
}

/// Bytes that f takes beside what was there before.
template <class F>
int64_t room_of(const F& f) {
  reset_peak_memory();
  const int64_t before = memory_stats().in_use;
  f();
  return memory_stats().peak - before;
}

constexpr int64_t kLong = 1 << 18, kBytes = 8 * kLong;

TEST(Tape, AddsUpInPlaceWhatNobodyShares) {
  const Tensor one = Tensor::full({kLong}, 1, DType::f64);
  Tape tape;
  const Var x = tape.leaf(one, 1);
  const Var y = scale(x, 2) + scale(x, 3) + scale(x, 4);
  Gradients g;
  EXPECT_LT(room_of([&] { g = tape.backward(y, one); }), 5 * kBytes / 2) << "the sum and one more";
  EXPECT_EQ(g.find(1)->item(kLong / 2), 9);
  EXPECT_EQ(one.item(), 1) << "the gradient that was given is the caller's";
}

TEST(Tape, TheGradientOfASplitIsOneConcatenation) {
  const Tensor one = Tensor::full({kLong}, 1, DType::f64);
  Tape tape;
  const Vars parts = split(tape.leaf(one, 1), 0, {kLong / 4, kLong / 2, kLong / 4});
  const Var y = concat({parts[2], parts[1], parts[0]}, 0);
  EXPECT_LT(room_of([&] { tape.backward(y, one); }), 5 * kBytes / 2) << "the parts and the whole";
}

TEST(Tape, SlicesNeedNoRoomOfTheWhole) {
  const int64_t parts = 64;
  const Tensor one = Tensor::full({parts, kLong / parts}, 1, DType::f64);
  Tape tape;
  const Var x = tape.leaf(one, 1);
  std::vector<Var> slices;
  for (int64_t i = 0; i < parts; ++i) slices.push_back(scale(slice(x, 0, i, i + 1), 2));
  const Var y = concat(std::span<const Var>(slices), 0);
  Gradients g;
  EXPECT_LT(room_of([&] { g = tape.backward(y, one); }), 5 * kBytes / 2)
      << "the gradients of all slices, and the sum";
  for (int64_t i = 0; i < kLong; i += kLong / parts) EXPECT_EQ(g.find(1)->item(i), 2);
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
  expect_error<Error>([&] { x + y; }, {"two tapes"});
  expect_error<Error>([&] { a.backward(sum_all(y)); }, {"this tape"});
}

TEST(Tape, RefusesABackwardOfManyNumbersOrOfAConstant) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2}), 1);
  expect_error<ShapeError>([&] { tape.backward(exp(x)); }, {"[2]", "not one number"});
  expect_error<Error>([&] { tape.backward(Var(values({1}))); }, {"does not depend"});
}

TEST(Tape, RefusesStaleValues) {
  Tape tape;
  const Var x = tape.leaf(values({1}), 1);
  const Var y = exp(x), loss = sum_all(y);
  tape.backward(loss);
  EXPECT_EQ(tape.size(), 0u);
  expect_error<Error>([&] { tape.backward(loss); }, {"consumed"});
  expect_error<Error>([&] { exp(y); }, {"consumed"});
  // A new leaf of the same tape is not mistaken for the old one.
  const Var fresh = tape.leaf(values({3}), 1);
  expect_error<Error>([&] { fresh + x; }, {"consumed"});
  EXPECT_DOUBLE_EQ(tape.backward(sum_all(square(fresh))).find(1)->item(), 6);
}

TEST(Tape, AValueThatOutlivesItsTapeIsAnErrorToComputeWith) {
  Var x, y;
  {
    Tape tape;
    x = tape.leaf(values({2}), 1);
    y = square(x);
  }
  EXPECT_TRUE(y.on_tape());
  EXPECT_DOUBLE_EQ(y.value.item(), 4) << "its numbers are there";
  EXPECT_DOUBLE_EQ(exp(y.detach()).value.item(), std::exp(4.0));
  expect_error<Error>([&] { exp(y); }, {"exp", "after the end of its tape", "detach()"});
  Tape next;  // perhaps where the last one was
  const Var z = next.leaf(values({3}), 1);
  expect_error<Error>([&] { x* z; }, {"after the end of its tape"});
  expect_error<Error>([&] { z* x; }, {"after the end of its tape"});
  expect_error<Error>([&] { next.backward(sum_all(y)); }, {"after the end of its tape"});
  expect_error<Error>([&] { next.backward(y); }, {"after the end of its tape"});
}

TEST(Tape, OpsKeepTheirOwnSkeletons) {
  // The lists of joints that the calls were given are gone before the backward pass reads them.
  Tape tape;
  const auto skeleton = [&](uint64_t id, int64_t joints) {
    Tensor local = Tensor::zeros({1, joints, 3, 3}, DType::f64);
    for (int64_t j = 0; j < joints; ++j)
      for (int64_t c = 0; c < 3; ++c) local.data<double>()[9 * j + 4 * c] = 1;
    Tensor rest = Tensor::zeros({1, joints, 3}, DType::f64);
    for (int64_t j = 0; j < joints; ++j) rest.data<double>()[3 * j + 1] = static_cast<double>(j);
    auto parents = std::make_unique<std::vector<int>>();
    for (int j = 0; j < joints; ++j) parents->push_back(j - 1);
    const Var posed = forward_kinematics(tape.leaf(local, id), Var(rest),
                                         Var(Tensor::zeros({1, 3}, DType::f64)), *parents);
    std::fill(parents->begin(), parents->end(), 1 << 28);
    auto swings = std::make_unique<std::vector<SwingJoint>>();
    for (int j = 0; j < joints; ++j)
      swings->push_back({j - 1, j + 1 < joints ? j + 1 : -1, -1, -1});
    const Var turned = swing_twist(tape.leaf(rest, id + 1), Var(rest.clone()),
                                   Var(Tensor::zeros({1, joints}, DType::f64)), *swings);
    for (SwingJoint& s : *swings) s.parent = s.child = 1 << 28;
    return sum_all(joints_of(posed)) + sum_all(turned);
  };
  const Gradients g = tape.backward(skeleton(1, 3) + skeleton(3, 5));
  for (const uint64_t id : {1, 2, 3, 4}) ASSERT_NE(g.find(id), nullptr) << id;
  // The position of joint 2 is that of joint 1 and G_1 (0, 1, 0): column 1 of the root's rotation
  // moves two joints, the last by two bones.
  for (int64_t row = 0; row < 3; ++row)
    EXPECT_DOUBLE_EQ(g.find(1)->item(3 * row + 1), 3) << "1 + 2 bones below the root";
  for (int64_t row = 0; row < 3; ++row)
    EXPECT_DOUBLE_EQ(g.find(3)->item(3 * row + 1), 10) << "1 + 2 + 3 + 4 bones";
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
  expect_error<Error>([&] { call(Seventeen{}, std::span<const Var>(many)); }, {"seventeen", "16"});
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
  expect_error<ShapeError>([&] { linear(x, w, b); },
                           {"linear", "x[..., i], W[o, i], b[o]", "i must agree", "[2, 3] float64",
                            "[4, 5] float64", "[4] float64", "skeleton.fc1"});
}

TEST(FiniteChecks, NameTheOpAndModuleOfTheForwardPass) {
  const Var x(values({1, 0}));
  EXPECT_TRUE(std::isinf(log(x).value.item(1)));  // silent without the check
  const FiniteCheck check;
  const ModuleScope outer("deformation"), inner("fc2");
  expect_error<NonFiniteError>([&] { log(x); }, {"forward", "'log'", "deformation.fc2"});
}

TEST(FiniteChecks, LookAtAllResultsOfAnOp) {
  const FiniteCheck check;
  const Var x(values({1, 2, std::numeric_limits<double>::infinity()}));
  expect_error<NonFiniteError>([&] { split(x, 0, {2, 1}); }, {"forward", "'split'"});
}

TEST(FiniteChecks, NameTheOpAndModuleOfTheBackwardPass) {
  const FiniteCheck check;
  Tape tape;
  Var y;
  {
    const ModuleScope scope("smrm.out");
    y = sqrt(tape.leaf(values({0}), 1));  // finite, with an infinite derivative
  }
  expect_error<NonFiniteError>([&] { tape.backward(sum_all(y)); },
                               {"backward", "'sqrt'", "smrm.out"});
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

enum class Fault { none, count, missing, shape, dtype, throws };

/// a * b with a fault in its backward pass.
struct Faulty {
  static constexpr const char* name = "faulty";
  static constexpr const char* letters = "a[n], b[n]";
  Fault fault = Fault::none;
  void check(Inputs) const {}
  Tensor forward(Inputs x, Saved& saved) const {
    saved.keep({x[0], x[1]});
    return binary(Binary::mul, x[0], x[1]);
  }
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const {
    if (fault == Fault::throws) throw Error("the kernel gave up");
    Grads g{binary(Binary::mul, gy, saved[1]), binary(Binary::mul, gy, saved[0])};
    if (fault == Fault::count) g.pop_back();
    if (fault == Fault::missing || !needs[1]) g[1] = Tensor();
    if (fault == Fault::shape) g[1] = g[1].reshape({1, g[1].numel()});
    if (fault == Fault::dtype) g[1] = g[1].cast(DType::f32);
    return g;
  }
};

/// A faulty op in the middle of a chain of sound ones.
struct Chain {
  explicit Chain(Fault fault) {
    const Var a = tape.leaf(values({1, 2}), 1), b = tape.leaf(values({3, 4}), 2);
    const ModuleScope scope("net.head");
    loss = sum_all(square(call(Faulty{fault}, {exp(a), b})));
  }
  Tape tape;
  Var loss;
};

TEST(BrokenOps, AreNamedWithWhatTheirBackwardGave) {
  const std::string where = "backward of 'faulty' in net.head: ";
  const auto backward = [](Fault fault) {
    return [fault] {
      Chain chain(fault);
      chain.tape.backward(chain.loss);
    };
  };
  EXPECT_NO_THROW(backward(Fault::none)());
  expect_error<Error>(backward(Fault::count), {where, "1 gradients for 2 inputs"});
  expect_error<Error>(backward(Fault::missing),
                      {where, "gradient of input 1 is none", "[2] float64"});
  expect_error<Error>(backward(Fault::shape), {where, "gradient of input 1 is [1, 2] float64"});
  expect_error<Error>(backward(Fault::dtype), {where, "gradient of input 1 is [2] float32"});
}

TEST(BrokenOps, MayLeaveOutAGradientThatIsNotNeeded) {
  Tape tape;
  const Var a = tape.leaf(values({1, 2}), 1);
  const Gradients g = tape.backward(sum_all(call(Faulty{}, {a, Var(values({3, 4}))})));
  EXPECT_EQ(g.find(1)->to_vector<double>(), (std::vector<double>{3, 4}));
}

TEST(BrokenOps, LeaveNoHalfConsumedTape) {
  Chain chain(Fault::throws);
  expect_error<Error>([&] { chain.tape.backward(chain.loss); }, {"the kernel gave up"});
  EXPECT_EQ(chain.tape.size(), 0u);
  expect_error<Error>([&] { chain.tape.backward(chain.loss); }, {"consumed"});
  const Var x = chain.tape.leaf(values({3}), 1);  // the tape itself is as good as new
  EXPECT_DOUBLE_EQ(chain.tape.backward(sum_all(square(x))).find(1)->item(), 6);
}

TEST(Nodes, SayWhatTheyAre) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2}), 1);
  exp(x) * x;
  ASSERT_EQ(tape.size(), 3u);
  EXPECT_STREQ(tape.name(0), "leaf");
  EXPECT_STREQ(tape.name(1), "exp");
  EXPECT_STREQ(tape.name(2), "mul");
  EXPECT_EQ(tape.saved(0), nullptr);
  EXPECT_EQ(tape.saved(2)->tensors().size(), 2u);
}

TEST(Versions, AreSharedByAllWhoShareMemory) {
  Tensor t = Tensor::zeros({2, 3}, DType::f64);
  const Tensor row = t.rows(1, 2), flat = t.reshape({6}), copy = t.clone();
  const uint64_t before = row.version();
  launch(AccumulateArgs{Tensor::full({2, 3}, 1, DType::f64), t});
  EXPECT_GT(row.version(), before);
  EXPECT_EQ(flat.version(), row.version());
  EXPECT_EQ(copy.version(), Tensor::zeros({1}).version());
  EXPECT_EQ(Tensor().version(), 0u);
}

/// Changes `victim` between the passes of a loss that `build` makes of it.
void expect_caught(const char* op, Tensor victim, const std::function<Var(const Var&)>& build) {
  Tape tape;
  const Var loss = build(tape.leaf(victim, 1));
  victim.written();
  expect_error<Error>([&] { tape.backward(loss); }, {"backward of '" + std::string(op) + "' in ",
                                                     "changed after the forward pass"});
}

TEST(ChangedInPlace, IsCaughtAndTheOpNamed) {
  const Tensor x = values({1, 2});
  const ModuleScope scope("net");
  expect_caught("mul", x.clone(), [](const Var& v) { return sum_all(v * v); });
  expect_caught("log", x.clone(), [](const Var& v) { return sum_all(log(v)); });
  expect_caught("mul", x.clone(), [](const Var& v) {  // through a view
    return sum_all(reshape(v, {2, 1}) * reshape(v, {1, 2}));
  });
  // A result, which its own op keeps.
  Tape tape;
  Var y = exp(tape.leaf(x, 1));
  const Var loss = sum_all(y);
  launch(AccumulateArgs{x, y.value});
  expect_error<Error>([&] { tape.backward(loss); }, {"'exp' in net", "changed"});
}

TEST(ChangedInPlace, AnOptimiserBetweenThePassesIsCaught) {
  Tensor w = Tensor::full({2, 2}, 0.5), m = Tensor::zeros({2, 2}), v = Tensor::zeros({2, 2});
  const Tensor g = Tensor::full({2, 2}, 1);
  Tape tape;
  const Var x = tape.leaf(Tensor::full({3, 2}, 1), 2);
  const Var loss = sum_all(linear(x, tape.leaf(w, 1)));
  const AdamArgs::Of moved[] = {{g, w, m, v, 1}};
  launch_all(AdamArgs{moved, 0.1, 0.9, 0.999, 1e-8, 0, 1});
  expect_error<Error>([&] { tape.backward(loss); }, {"'linear'", "changed"});
}

TEST(ChangedInPlace, AnIndexIsCaught) {
  Tensor index = Tensor::from<int32_t>({1, 2}, {1, 0});
  Tape tape;
  const Var rows = gather(tape.leaf(Tensor::full({1, 3, 2}, 1), 1), index);
  index.written();
  expect_error<Error>([&] { tape.backward(sum_all(rows)); }, {"'gather'", "changed"});
}

TEST(ChangedInPlace, WhatNobodyKeptMayChange) {
  Tensor x = values({1, 2});
  Tape tape;
  const Var loss = sum_all(scale(tape.leaf(x, 1) + Var(values({3, 4})), 2));
  x.written();
  EXPECT_EQ(tape.backward(loss).find(1)->to_vector<double>(), (std::vector<double>{2, 2}));
}

TEST(InnerGradients, AreThoseThatWereAskedFor) {
  Tape tape;
  const Var x = tape.leaf(values({1, 2, 3}), 1), y = square(x), z = exp(x);
  tape.keep_gradient(y);
  const Gradients g = tape.backward(sum_all(y * z));
  ASSERT_NE(g.find(y), nullptr);
  EXPECT_EQ(g.find(y)->to_vector<double>(), z.value.to_vector<double>());
  EXPECT_EQ(g.find(z), nullptr);
  EXPECT_EQ(g.size(), 1u);
  EXPECT_EQ(g.find(Var(values({1}))), nullptr);
  expect_error<Error>([&] { tape.keep_gradient(Var(values({1}))); }, {"constant"});
  expect_error<Error>([&] { tape.keep_gradient(y); }, {"consumed"});
  const Var again = tape.leaf(values({4}), 1);  // nothing is kept for a second pass
  EXPECT_EQ(tape.backward(sum_all(square(again))).find(again), nullptr);
}

TEST(Backward, TakesAGradientOfAnyShape) {
  Tape tape;
  const Var y = square(tape.leaf(values({1, 2, 3}), 1));
  expect_error<Error>([&] { tape.backward(y); }, {"not one number"});
  expect_error<ShapeError>([&] { tape.backward(y, values({1, 2})); }, {"its gradient"});
  expect_error<ShapeError>([&] { tape.backward(y, Tensor::full({3}, 1, DType::f32)); },
                           {"its gradient"});
  EXPECT_EQ(tape.backward(y, values({10, 100, 1000})).find(1)->to_vector<double>(),
            (std::vector<double>{20, 400, 6000}));
}

}  // namespace
}  // namespace restage
