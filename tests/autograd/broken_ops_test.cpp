// What the tape does not forgive: ops whose backward breaks its promises, values changed between
// the passes, and a second backward pass after a failed one.
#include <gtest/gtest.h>

#include "autograd/kernels/update.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

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

Tensor values(const std::vector<double>& v) {
  return Tensor::from<double>({static_cast<int64_t>(v.size())}, v);
}

void expect_error(const std::function<void()>& f, const std::vector<std::string>& words) {
  try {
    f();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& error) {
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
          << "'" << word << "' is not in: " << error.what();
  }
}

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
  expect_error(backward(Fault::count), {where, "1 gradients for 2 inputs"});
  expect_error(backward(Fault::missing), {where, "gradient of input 1 is none", "[2] float64"});
  expect_error(backward(Fault::shape), {where, "gradient of input 1 is [1, 2] float64"});
  expect_error(backward(Fault::dtype), {where, "gradient of input 1 is [2] float32"});
}

TEST(BrokenOps, MayLeaveOutAGradientThatIsNotNeeded) {
  Tape tape;
  const Var a = tape.leaf(values({1, 2}), 1);
  const Gradients g = tape.backward(sum_all(call(Faulty{}, {a, Var(values({3, 4}))})));
  EXPECT_EQ(g.find(1)->to_vector<double>(), (std::vector<double>{3, 4}));
}

TEST(BrokenOps, LeaveNoHalfConsumedTape) {
  Chain chain(Fault::throws);
  expect_error([&] { chain.tape.backward(chain.loss); }, {"the kernel gave up"});
  EXPECT_EQ(chain.tape.size(), 0u);
  expect_error([&] { chain.tape.backward(chain.loss); }, {"consumed"});
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
  expect_error([&] { tape.backward(loss); },
               {"backward of '" + std::string(op) + "' in ", "changed after the forward pass"});
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
  expect_error([&] { tape.backward(loss); }, {"'exp' in net", "changed"});
}

TEST(ChangedInPlace, AnOptimiserBetweenThePassesIsCaught) {
  Tensor w = Tensor::full({2, 2}, 0.5), m = Tensor::zeros({2, 2}), v = Tensor::zeros({2, 2});
  const Tensor g = Tensor::full({2, 2}, 1);
  Tape tape;
  const Var x = tape.leaf(Tensor::full({3, 2}, 1), 2);
  const Var loss = sum_all(linear(x, tape.leaf(w, 1)));
  launch(AdamArgs{g, w, m, v, nullptr, 0.1, 0.9, 0.999, 1e-8, 0, 1, 1});
  expect_error([&] { tape.backward(loss); }, {"'linear'", "changed"});
}

TEST(ChangedInPlace, AnIndexIsCaught) {
  Tensor index = Tensor::from<int32_t>({1, 2}, {1, 0});
  Tape tape;
  const Var rows = gather(tape.leaf(Tensor::full({1, 3, 2}, 1), 1), index);
  index.written();
  expect_error([&] { tape.backward(sum_all(rows)); }, {"'gather'", "changed"});
}

TEST(ChangedInPlace, WhatNobodyKeptMayChange) {
  Tensor x = values({1, 2});
  Tape tape;
  const Var loss = sum_all(scale(tape.leaf(x, 1) + Var(values({3, 4})), 2));
  x.written();
  EXPECT_EQ(tape.backward(loss).find(1)->to_vector<double>(), (std::vector<double>{2, 2}));
}

}  // namespace
}  // namespace restage
