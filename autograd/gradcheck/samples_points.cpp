#include "autograd/gradcheck/samples.h"
#include "autograd/ops/points.h"

namespace restage::gradcheck {

void add_points(Table& t) {
  OpSamples s = samples_for<AttentionPool>();
  const auto with = [](double scale) {
    return Build([scale](Args x) { return attention_pool(x[0], x[1], scale); });
  };
  for (const Shape& x : {Shape{3, 4, 5}, Shape{1, 1, 1}, Shape{2, 1, 3}, Shape{0, 4, 3},
                         Shape{2, 3, 0}, Shape{2, 3, 17}})
    s.add(x.str(), {random(x, 61), random(x, 62)}, with(0.7));
  s.add("scores far apart", {f64({1, 3, 1}, {-900, 0, 900}), random({1, 3, 1}, 1)}, with(0.5));
  s.error("negative scale", {random({1, 3, 1}, 1), random({1, 3, 1}, 2)}, with(-0.5));
  s.large("many", {random({700, 8, 9}, 63), random({700, 8, 9}, 64)}, with(0.3));
  s.error("shapes differ", {random({2, 3, 4}, 1), random({2, 3, 5}, 2)}, with(1));
  s.error("two axes", {random({3, 4}, 1), random({3, 4}, 2)}, with(1));
  s.error("no neighbour", {random({2, 0, 4}, 1), random({2, 0, 4}, 2)}, with(1));
  s.error("two dtypes", {random({2, 3, 4}, 1), random({2, 3, 4}, 2).cast(DType::f32)}, with(1));
  s.error("integers", {i32({1, 1, 1}, {1}), i32({1, 1, 1}, {1})}, with(1));
  s.random = [with](Rng& rng) {
    const Shape x{random_size(rng, 1, 4), random_size(rng, 1, 5), random_size(rng, 1, 6)};
    return Sample{"", {random(x, rng), random(x, rng)}, with(rng.uniform(0.1, 2))};
  };
  t.push_back(s);
}

}  // namespace restage::gradcheck
