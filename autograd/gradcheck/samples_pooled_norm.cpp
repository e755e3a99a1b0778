#include <cmath>

#include "autograd/gradcheck/samples.h"
#include "autograd/ops/pooled_norm.h"

namespace restage::gradcheck {
namespace {

/// x [n, v, i], W, b, scale (away from 0, where the maximum jumps) and shift.
std::vector<Tensor> inputs_of(int64_t n, int64_t v, int64_t i, int64_t o, uint64_t stream) {
  return {random({n, v, i}, stream), random({o, i}, stream + 1), random({o}, stream + 2),
          random({o}, stream + 3, 0.1), random({o}, stream + 4)};
}

void add_variant(OpSamples& s, const std::string& how, const Build& build) {
  s.add("[2, 5, 3] x 4" + how, inputs_of(2, 5, 3, 4, 81), build);
  s.add("one cloud" + how, inputs_of(1, 7, 2, 3, 82), build);
  s.add("one channel" + how, inputs_of(3, 4, 1, 1, 83), build);
  s.add("more points and channels than a tile" + how, inputs_of(2, 29, 5, 35, 84), build);
  std::vector<Tensor> far = inputs_of(2, 9, 3, 5, 85);
  for (double& x : std::span<double>(far[0].data<double>(), 54)) x = 30 + x;
  s.add("far from 0" + how, far, build);
  s.large("many points" + how, inputs_of(3, 700, 9, 65, 86), build);
}

void add_kinks(OpSamples& s, const Build& plain, const Build& with_relu) {
  // Mean 0, variance 1 - eps (so rstd 1), two points at the top: the first receives the gradient.
  const double a = std::sqrt(1 - 1e-5), q = a * a / 4;
  const Tensor x = f64({1, 4, 1}, {-a, a, a, -a}), w = f64({1, 1}, {1});
  const Tensor one = f64({1}, {1}), zero = f64({1}, {0});
  s.kink("equal maxima", {x, w, zero, one, zero}, plain,
         {f64({1, 4, 1}, {q - 0.25, 0.75 - q, -0.25 - q, q - 0.25}), f64({1, 1}, {1e-5 * a}), zero,
          f64({1}, {a}), one});
  // Scale 0: all points are equal, the first one is the maximum.
  const Tensor no_x = Tensor::zeros({1, 4, 1}, DType::f64),
               no_w = Tensor::zeros({1, 1}, DType::f64);
  s.kink("scale 0", {x, w, zero, zero, one}, plain, {no_x, no_w, zero, f64({1}, {-a}), one});
  s.kink("relu at 0", {x, w, zero, zero, zero}, with_relu, {no_x, no_w, zero, zero, zero});
}

}  // namespace

void add_pooled_norm(Table& t) {
  t.push_back(samples_for<PooledNorm>());
  OpSamples& s = t.back();
  const Build plain = [](Args x) { return pooled_norm(x[0], x[1], x[2], x[3], x[4]); };
  const Build with_relu = [](Args x) {
    return pooled_norm(x[0], x[1], x[2], x[3], x[4], Activation::relu);
  };
  add_variant(s, "", plain);
  add_variant(s, ", relu", with_relu);
  s.add("no channel", inputs_of(2, 3, 2, 0, 1), plain).zero_gradient = true;
  std::vector<Tensor> inputs = inputs_of(2, 3, 2, 2, 87);
  inputs[4] = f64({2}, {-9, -9});
  s.add("all clipped", inputs, with_relu).zero_gradient = true;
  add_kinks(s, plain, with_relu);
  s.error("i differs",
          {random({2, 3, 2}, 1), random({4, 3}, 2), random({4}, 3), random({4}, 4), random({4}, 5)},
          plain);
  s.error("o differs",
          {random({2, 3, 2}, 1), random({4, 2}, 2), random({4}, 3), random({1}, 4), random({4}, 5)},
          plain);
  s.error("two axes",
          {random({3, 2}, 1), random({4, 2}, 2), random({4}, 3), random({4}, 4), random({4}, 5)},
          plain);
  s.error("one point", inputs_of(1, 1, 2, 2, 1), plain);
  s.error("no point", inputs_of(2, 0, 2, 2, 1), plain);
  inputs = inputs_of(2, 3, 2, 2, 1);
  inputs[1] = inputs[1].cast(DType::f32);
  s.error("two dtypes", inputs, plain);
  s.random = [plain, with_relu](Rng& rng) {
    const int64_t n = random_size(rng, 1, 3), v = random_size(rng, 3, 15);
    return Sample{"",
                  inputs_of(n, v, random_size(rng, 1, 6), random_size(rng, 1, 8), rng.below(1000)),
                  rng.below(2) ? plain : with_relu};
  };
}

}  // namespace restage::gradcheck
