#include "autograd/gradcheck/samples.h"
#include "autograd/ops/attention.h"

namespace restage::gradcheck {
namespace {

struct Sizes {
  int64_t n, v, k, d;
};

/// Rows that differ by `spread`.
Tensor alike(const Shape& shape, Rng& rng, double spread) {
  Tensor x = random(shape, rng);
  const int64_t d = shape[-1];
  for (int64_t i = d; i < x.numel(); ++i)
    x.data<double>()[i] = spread < 1 ? x.item(i % d) + spread * x.item(i) : x.item(i);
  return x;
}

/// Inputs of the attention; `spread` of the points, queries and keys decides how many units are
/// active in a tile.
std::vector<Tensor> inputs(const Sizes& s, Rng& rng, double spread) {
  const Shape rows{s.n, s.v, s.d};
  return {alike({s.n, s.v, 3}, rng, spread),
          alike(rows, rng, spread),
          alike(rows, rng, spread),
          random(rows, rng),
          random({s.d, 3}, rng),
          random({s.d}, rng, 0.1),
          random({2 * s.d, s.d}, rng),
          random({s.d, s.d}, rng),
          random({s.d}, rng)};
}

Build with(const Tensor& index, bool dense) {
  return [index, dense](Args x) {
    return neighbour_attention({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]},
                               index.to(x[0].value.device()), 0.3, dense);
  };
}

}  // namespace

void add_attention(Table& t) {
  OpSamples s = samples_for<NeighbourAttention>();
  Rng rng(RngKey{71, 0});
  const auto add = [&](const std::string& name, const Sizes& z, double spread, bool dense) {
    const std::vector<Tensor> x = inputs(z, rng, spread);
    s.add(name, x, with(random_index({z.n, z.v, z.k}, rng, z.v), dense));
  };
  add("one", {1, 1, 1, 1}, 1, false);
  add("far apart", {2, 4, 3, 5}, 1, false);
  add("close together", {2, 4, 3, 5}, 0.02, false);
  add("close together, in full", {2, 4, 3, 5}, 0.02, true);
  add("few active units", {1, 5, 3, 24}, 0.01, false);
  add("no active unit", {2, 3, 2, 16}, 1e-5, false);
  add("few active units, several tiles", {1, 5, 60, 16}, 0.01, false);
  add("several tiles", {1, 7, 100, 2}, 0.1, false);
  add("no cloud", {0, 3, 2, 2}, 1, false);
  const std::vector<Tensor> small = inputs({1, 2, 1, 2}, rng, 1);
  s.error("index out of range", small, with(i32({1, 2, 1}, {0, 2}), false));
  s.error("index of another cloud", small, with(i32({2, 2, 1}, {0, 0, 0, 0}), false));
  s.error(
      "integers as offsets",
      {small[0], small[1], small[2], small[3], small[4], small[5], small[7], small[6], small[8]},
      with(i32({1, 2, 1}, {0, 1}), false));
  s.large("many tiles", inputs({2, 300, 5, 9}, rng, 1),
          with(random_index({2, 300, 5}, rng, 300), false));
  s.random = [](Rng& r) {
    const Sizes z{random_size(r, 1, 2), random_size(r, 1, 5), random_size(r, 1, 4),
                  random_size(r, 1, 6)};
    const std::vector<Tensor> x = inputs(z, r, r.uniform(0.01, 1));
    return Sample{"", x, with(random_index({z.n, z.v, z.k}, r, z.v), r.uniform() < 0.3)};
  };
  t.push_back(s);
}

}  // namespace restage::gradcheck
