#include "autograd/gradcheck/samples.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/transport.h"

namespace restage::gradcheck {
namespace {

/// Positive numbers, as those of a kernel are.
std::vector<Tensor> kernel(const Shape& shape, uint64_t stream) {
  return {exp(Var(random(shape, stream))).value};
}

Build with(int steps) {
  return [steps](Args x) { return sinkhorn(x[0], steps, 1e-3); };
}

}  // namespace

void add_transport(Table& t) {
  OpSamples s = samples_for<Sinkhorn>();
  s.add("two steps", kernel({2, 4, 3}, 121), with(2));
  s.add("one step", kernel({1, 3, 5}, 122), with(1));
  s.add("more steps than an op has inputs", kernel({1, 2, 3}, 123), with(9));
  s.add("one number", kernel({1, 1, 1}, 124), with(2));
  s.add("no item", kernel({0, 2, 3}, 125), with(2)).zero_gradient = true;
  s.large("many", kernel({2, 90, 70}, 126), with(3));
  s.error("two axes", {random({2, 3}, 1)}, with(2));
  s.error("no point", {random({1, 0, 3}, 1)}, with(2));
  s.error("no step", {random({1, 2, 3}, 1)}, with(0));
  s.error("integers", {i32({1, 1, 2}, {1, 2})}, with(2));
  s.random = [](Rng& rng) {
    const Shape shape{random_size(rng, 1, 3), random_size(rng, 1, 6), random_size(rng, 1, 6)};
    return Sample{"", kernel(shape, rng.below(1000)),
                  with(static_cast<int>(random_size(rng, 1, 4)))};
  };
  t.push_back(s);
}

}  // namespace restage::gradcheck
