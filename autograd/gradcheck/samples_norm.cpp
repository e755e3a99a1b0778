#include "autograd/gradcheck/samples.h"
#include "autograd/ops/norm.h"

namespace restage::gradcheck {
namespace {

using AffineNorm = std::function<Var(Args)>;

std::vector<Tensor> affine_inputs(const Shape& x, uint64_t stream) {
  return {random(x, stream), random({x[-1]}, stream + 1), random({x[-1]}, stream + 2)};
}

/// Shared by batch and layer norm.
void affine_samples(OpSamples& s, const Build& build, int64_t least_rows) {
  for (const Shape& x :
       {Shape{5, 3}, Shape{2, 3, 4}, Shape{2, 1}, Shape{4, 0}, Shape{9, 17}, Shape{2, 1, 1, 3}})
    s.add(x.str(), affine_inputs(x, 51), build);
  Tensor narrow = random({6, 5}, 50);
  for (double& v : std::span<double>(narrow.data<double>(), 30)) v = 3 + 0.3 * v;
  s.add("narrow channels far from 0", {narrow, random({5}, 1), random({5}, 2)}, build);
  s.large("many rows", affine_inputs({1301, 40}, 52), build);
  s.error("one axis", affine_inputs({3}, 1), build);
  s.error("c differs", {random({4, 3}, 1), random({2}, 2), random({3}, 3)}, build);
  s.error("c differs in shift", {random({4, 3}, 1), random({3}, 2), random({1}, 3)}, build);
  s.error("two dtypes", {random({4, 3}, 1), random({3}, 2).cast(DType::f32), random({3}, 3)},
          build);
  s.error("integers", {i32({2, 1}, {1, 2}), i32({1}, {1}), i32({1}, {1})}, build);
  s.random = [build, least_rows](Rng& rng) {
    const Shape x{random_size(rng, least_rows, 4), random_size(rng, 1, 4), random_size(rng, 1, 5)};
    return Sample{"", {random(x, rng), random({x[-1]}, rng), random({x[-1]}, rng)}, build};
  };
}

}  // namespace

void add_norm(Table& t) {
  t.push_back(samples_for<BatchNorm>());
  const Build batch = [](Args x) { return batch_norm(x[0], x[1], x[2]); };
  affine_samples(t.back(), batch, 2);
  t.back().error("one row", affine_inputs({1, 3}, 1), batch);
  t.back().error("no row", affine_inputs({0, 3}, 1), batch);

  t.push_back(samples_for<LayerNorm>());
  const Build layer = [](Args x) { return layer_norm(x[0], x[1], x[2]); };
  affine_samples(t.back(), layer, 1);
  t.back().add("no row", affine_inputs({0, 3}, 1), layer).zero_gradient = true;

  t.push_back(samples_for<InstanceNorm>());
  OpSamples& s = t.back();
  const Build instance = [](Args x) { return instance_norm(x[0]); };
  for (const Shape& x :
       {Shape{2, 5, 3}, Shape{1, 4, 1}, Shape{0, 4, 3}, Shape{2, 3, 0}, Shape{3, 2, 17}})
    s.add(x.str(), {random(x, 53)}, instance);
  s.add("one point", {random({2, 1, 3}, 54)}, instance).zero_gradient = true;
  s.large("many points", {random({3, 1100, 9}, 55)}, instance);
  s.large("one sample of many points", {random({1, 1100, 19}, 56)}, instance);
  s.error("two axes", {random({4, 3}, 1)}, instance);
  s.error("no point", {random({2, 0, 3}, 1)}, instance);
  s.error("integers", {i32({1, 2, 1}, {1, 2})}, instance);
  s.random = [instance](Rng& rng) {
    const Shape x{random_size(rng, 1, 3), random_size(rng, 2, 6), random_size(rng, 1, 5)};
    return Sample{"", {random(x, rng)}, instance};
  };
}

}  // namespace restage::gradcheck
