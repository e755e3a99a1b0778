#include "autograd/gradcheck/samples.h"

#include "autograd/base/registry.h"

namespace restage::gradcheck {

namespace {

Registry<OpSamples, &OpSamples::op>& known() {
  static Registry<OpSamples, &OpSamples::op> all("op", [] {
    Table t;
    add_attention(t);
    add_cross_attention(t);
    add_elementwise(t);
    add_layout(t);
    add_linear(t);
    add_modulate(t);
    add_norm(t);
    add_points(t);
    add_pooled_norm(t);
    add_reduce(t);
    add_rnn(t);
    add_rotation(t);
    add_swing(t);
    add_transport(t);
    return t;
  }());
  return all;
}

}  // namespace

const Table& all_samples() { return known().all(); }

void register_op(OpSamples samples) { known().add(std::move(samples)); }

int64_t random_size(Rng& rng, int64_t least, int64_t most) {
  return least + static_cast<int64_t>(rng.below(static_cast<uint64_t>(most - least + 1)));
}

Shape random_shape(Rng& rng, int min_rank, int max_rank, int64_t most) {
  Shape shape;
  const int64_t rank = random_size(rng, min_rank, max_rank);
  for (int64_t i = 0; i < rank; ++i)
    shape.push_back(rng.below(16) == 0 ? 0 : random_size(rng, 1, most));
  return shape;
}

Tensor random(const Shape& shape, Rng& rng, double gap) {
  return random(shape, rng.below(uint64_t{1} << 40), gap);
}

Tensor distinct(const Shape& shape) {
  Tensor t = Tensor::empty(shape, DType::f64);
  const int64_t n = t.numel();
  for (int64_t i = 0; i < n; ++i)  // 7919 is prime and divides no size used here
    t.data<double>()[i] = 1e-3 * static_cast<double>(i * 7919 % n) - 5e-4 * static_cast<double>(n);
  return t;
}

Tensor random_index(const Shape& shape, Rng& rng, int64_t limit) {
  Tensor t = Tensor::empty(shape, DType::i32);
  for (int64_t i = 0; i < t.numel(); ++i)
    t.data<int32_t>()[i] = static_cast<int32_t>(rng.below(static_cast<uint64_t>(limit)));
  return t;
}

Tensor f64(const Shape& shape, const std::vector<double>& values) {
  return Tensor::from<double>(shape, values);
}

Tensor i32(const Shape& shape, const std::vector<int32_t>& values) {
  return Tensor::from<int32_t>(shape, values);
}

}  // namespace restage::gradcheck
