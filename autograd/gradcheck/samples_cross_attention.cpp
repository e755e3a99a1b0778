#include "autograd/gradcheck/samples.h"
#include "autograd/ops/cross_attention.h"

namespace restage::gradcheck {
namespace {

std::vector<Tensor> inputs(int64_t n, int64_t t, int64_t m, int64_t d, int64_t c, Rng& rng) {
  return {random({n, t, d}, rng), random({n, m, d}, rng), random({n, m, c}, rng)};
}

Build with(double factor, int64_t most) {
  return [factor, most](Args x) { return call(CrossAttention{factor, most}, {x[0], x[1], x[2]}); };
}

}  // namespace

void add_cross_attention(Table& t) {
  OpSamples s = samples_for<CrossAttention>();
  Rng rng(RngKey{83, 0});
  const int64_t usual = CrossAttention{}.most_scores;
  s.add("one", inputs(1, 1, 1, 1, 1, rng), with(1, usual));
  s.add("other numbers", inputs(2, 5, 7, 4, 3, rng), with(0.5, usual));
  s.add("items of several parts", inputs(5, 3, 4, 2, 3, rng), with(1, 24));
  s.add("queries of several parts", inputs(2, 7, 5, 3, 2, rng), with(0.7, 15));
  s.add("one query a part", inputs(2, 3, 5, 3, 2, rng), with(1, 1));
  s.add("no query", inputs(2, 0, 5, 3, 2, rng), with(1, usual)).zero_gradient = true;
  s.add("no item", inputs(0, 2, 5, 3, 2, rng), with(1, usual));
  s.large("several parts", inputs(2, 150, 210, 8, 9, rng), with(0.3, 9000));
  s.error("d differs", {random({1, 2, 3}, rng), random({1, 2, 4}, rng), random({1, 2, 4}, rng)},
          with(1, usual));
  s.error("no key", inputs(1, 2, 0, 3, 2, rng), with(1, usual));
  s.error("n differs", {random({1, 2, 3}, rng), random({2, 2, 3}, rng), random({1, 2, 4}, rng)},
          with(1, usual));
  s.error("integers", {i32({1, 1, 1}, {1}), i32({1, 1, 1}, {1}), i32({1, 1, 1}, {1})},
          with(1, usual));
  s.random = [](Rng& r) {
    const std::vector<Tensor> x =
        inputs(random_size(r, 1, 3), random_size(r, 1, 6), random_size(r, 1, 6),
               random_size(r, 1, 5), random_size(r, 1, 5), r);
    return Sample{"", x, with(r.uniform(0.2, 2), random_size(r, 1, 40))};
  };
  t.push_back(s);
}

}  // namespace restage::gradcheck
