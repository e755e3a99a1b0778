#include "autograd/gradcheck/samples.h"
#include "autograd/ops/linear.h"

namespace restage::gradcheck {
namespace {

Build linear_with(Activation activation, bool bias) {
  return [activation, bias](Args x) {
    return bias ? linear(x[0], x[1], x[2], activation) : linear(x[0], x[1]);
  };
}

void add_linear_op(Table& t) {
  OpSamples s = samples_for<LinearOp>();
  const Build plain = linear_with(Activation::none, true);
  const auto add = [&](const Shape& x, int64_t out) {
    s.add(x.str() + " to " + std::to_string(out),
          {random(x, 1), random({out, x[-1]}, 2), random({out}, 3)}, plain);
  };
  add({3, 4}, 5);
  add({2, 3, 4}, 2);
  add({4}, 3);
  add({1, 1}, 1);
  add({0, 4}, 3);
  add({2, 3}, 0);
  add({13, 17}, 33);
  add({2, 0}, 3);
  s.add("without bias", {random({3, 4}, 1), random({2, 4}, 2)},
        linear_with(Activation::none, false));
  s.add("with relu", {random({6, 4}, 1), random({5, 4}, 2), random({5}, 3)},
        linear_with(Activation::relu, true));
  s.large("large", {random({301, 67}, 1), random({130, 67}, 2), random({130}, 3)}, plain);
  for (const int64_t rows : {1, 4})
    s.large("few rows, weights read as they lie",
            {random({rows, 578}, 1), random({150, 578}, 2), random({150}, 3)}, plain);
  s.kink("relu at 0 has derivative 0",
         {f64({1, 2}, {1, 2}), f64({2, 2}, {1, 1, 2, -1}), f64({2}, {-3, 1})},
         linear_with(Activation::relu, true),
         {f64({1, 2}, {2, -1}), f64({2, 2}, {0, 0, 1, 2}), f64({2}, {0, 1})});
  s.error("i differs", {random({3, 4}, 1), random({5, 3}, 2), random({5}, 3)}, plain);
  s.error("o differs", {random({3, 4}, 1), random({5, 4}, 2), random({4}, 3)}, plain);
  s.error("weight of one axis", {random({3, 4}, 1), random({4}, 2), random({4}, 3)}, plain);
  s.error("number without axes", {random({}, 1), random({4, 1}, 2), random({4}, 3)}, plain);
  s.error("two dtypes", {random({3, 4}, 1), random({5, 4}, 2).cast(DType::f32), random({5}, 3)},
          plain);
  s.random = [plain](Rng& rng) {
    const Shape x = random_shape(rng, 1, 4, 7);
    const int64_t out = random_size(rng, 1, 9);
    return Sample{"", {random(x, rng), random({out, x[-1]}, rng), random({out}, rng)}, plain};
  };
  t.push_back(s);
}

Build matmul_with(bool ta, bool tb) {
  return [ta, tb](Args x) { return matmul(x[0], x[1], ta, tb); };
}

/// Shapes of both factors of an m x k times k x n product; batch < 0: no batch axis.
std::vector<Tensor> factors(int64_t ba, int64_t bb, int64_t m, int64_t k, int64_t n, bool ta,
                            bool tb, Rng& rng) {
  Shape a, b;
  if (ba >= 0) a.push_back(ba);
  if (bb >= 0) b.push_back(bb);
  for (const int64_t d : {ta ? k : m, ta ? m : k}) a.push_back(d);
  for (const int64_t d : {tb ? n : k, tb ? k : n}) b.push_back(d);
  return {random(a, rng), random(b, rng)};
}

void add_matmul(Table& t) {
  OpSamples s = samples_for<Matmul>();
  Rng rng(RngKey{22, 0});
  for (const bool ta : {false, true})
    for (const bool tb : {false, true}) {
      const std::string how = std::string(ta ? " a^T" : " a") + (tb ? " b^T" : " b");
      s.add("matrices" + how, factors(-1, -1, 3, 4, 5, ta, tb, rng), matmul_with(ta, tb));
      s.add("batches" + how, factors(2, 2, 3, 4, 5, ta, tb, rng), matmul_with(ta, tb));
      s.add("shared second" + how, factors(2, -1, 3, 1, 2, ta, tb, rng), matmul_with(ta, tb));
      s.add("shared first" + how, factors(-1, 2, 1, 3, 2, ta, tb, rng), matmul_with(ta, tb));
      s.add("no m" + how, factors(-1, -1, 0, 3, 2, ta, tb, rng), matmul_with(ta, tb))
          .zero_gradient = true;
      s.add("empty batch" + how, factors(0, -1, 2, 3, 2, ta, tb, rng), matmul_with(ta, tb))
          .zero_gradient = true;
      s.add("no k" + how, factors(2, 2, 3, 0, 2, ta, tb, rng), matmul_with(ta, tb));
      s.large("large" + how, factors(-1, -1, 130, 270, 141, ta, tb, rng), matmul_with(ta, tb));
    }
  const Build plain = matmul_with(false, false);
  s.large("deeper than is packed at a time", factors(-1, -1, 310, 1400, 130, false, false, rng),
          plain);
  s.error("k differs", {random({2, 3}, 1), random({4, 2}, 2)}, plain);
  s.error("k differs, transposed", {random({2, 3}, 1), random({2, 4}, 2)},
          matmul_with(false, true));
  s.error("b differs", {random({2, 2, 3}, 1), random({3, 3, 2}, 2)}, plain);
  s.error("a vector", {random({3}, 1), random({3, 2}, 2)}, plain);
  s.error("two dtypes", {random({2, 3}, 1), random({3, 2}, 2).cast(DType::f32)}, plain);
  s.error("integers", {i32({1, 1}, {1}), i32({1, 1}, {1})}, plain);
  s.random = [](Rng& r) {
    const bool ta = r.below(2) == 1, tb = r.below(2) == 1;
    const int64_t batch = random_size(r, 1, 3);
    const int64_t ba = r.below(2) ? batch : -1, bb = r.below(2) ? batch : -1;
    const int64_t m = random_size(r, 1, 9), k = random_size(r, 1, 9), n = random_size(r, 1, 9);
    return Sample{"", factors(ba, bb, m, k, n, ta, tb, r), matmul_with(ta, tb)};
  };
  t.push_back(s);
}

}  // namespace

void add_linear(Table& t) {
  add_linear_op(t);
  add_matmul(t);
}

}  // namespace restage::gradcheck
