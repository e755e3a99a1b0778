#include "autograd/gradcheck/samples.h"
#include "autograd/ops/modulate.h"

namespace restage::gradcheck {
namespace {

std::vector<Tensor> inputs(int64_t n, int64_t rows, int64_t v, int64_t c, uint64_t stream) {
  return {random({n, rows, c}, stream), random({n, v, 3}, stream + 1), random({c, 3}, stream + 2),
          random({c}, stream + 3),      random({c, 3}, stream + 4),    random({c}, stream + 5)};
}

Build with(Activation activation) {
  return [activation](Args x) { return modulate(x[0], x[1], x[2], x[3], x[4], x[5], activation); };
}

std::vector<Tensor> elain_inputs(int64_t n, int64_t v, int64_t c, uint64_t stream) {
  std::vector<Tensor> out;
  for (uint64_t k = 0; k < 4; ++k) out.push_back(random({n, v, c}, stream + k));
  out.push_back(random({n, c}, stream + 4));
  return out;
}

Build elain_with(double slope) {
  return [slope](Args x) { return elain(x[0], x[1], x[2], x[3], x[4], slope); };
}

void add_elain(Table& t) {
  OpSamples s = samples_for<ElainMix>();
  const Build build = elain_with(0.2);
  s.add("two items", elain_inputs(2, 4, 3, 131), build);
  s.add("no activation", elain_inputs(1, 3, 17, 132), elain_with(1));
  s.add("one point", elain_inputs(2, 1, 4, 133), build);
  s.add("no point", elain_inputs(2, 0, 4, 134), build).zero_gradient = true;
  s.add("no item", elain_inputs(0, 3, 4, 135), build).zero_gradient = true;
  s.add("no channel", elain_inputs(2, 3, 0, 136), build).zero_gradient = true;
  s.large("several parts", elain_inputs(2, 300, 9, 137), build);
  std::vector<Tensor> x = elain_inputs(1, 3, 4, 1);
  x[2] = random({1, 3, 5}, 1);
  s.error("c differs", x, build);
  x = elain_inputs(1, 3, 4, 1);
  x[4] = random({1, 1, 4}, 1);
  s.error("a share with three axes", x, build);
  x = elain_inputs(1, 3, 4, 1);
  x[3] = x[3].cast(DType::f32);
  s.error("two dtypes", x, build);
  s.random = [build](Rng& rng) {
    return Sample{"",
                  elain_inputs(random_size(rng, 1, 3), random_size(rng, 1, 6),
                               random_size(rng, 1, 20), rng.below(1000)),
                  build};
  };
  t.push_back(s);
}

}  // namespace

void add_modulate(Table& t) {
  add_elain(t);
  OpSamples s = samples_for<Modulate>();
  const Build plain = with(Activation::none), with_relu = with(Activation::relu);
  s.add("a row for each point", inputs(2, 5, 5, 3, 91), plain);
  s.add("relu", inputs(2, 5, 5, 3, 92), with_relu);
  s.add("one row for all points", inputs(2, 1, 5, 3, 93), plain);
  s.add("one row, relu", inputs(3, 1, 4, 17, 94), with_relu);
  s.add("one point", inputs(2, 1, 1, 4, 95), plain);
  s.add("no point", inputs(2, 0, 0, 4, 96), plain).zero_gradient = true;
  s.add("one row for no point", inputs(2, 1, 0, 4, 96), plain).zero_gradient = true;
  s.add("no item", inputs(0, 3, 3, 4, 97), plain).zero_gradient = true;
  s.add("no channel", inputs(2, 3, 3, 0, 97), plain).zero_gradient = true;
  s.large("several parts", inputs(2, 300, 300, 9, 98), plain);
  s.large("one row, several parts", inputs(2, 1, 300, 9, 99), plain);
  s.error("two rows for three points", inputs(1, 2, 3, 4, 1), plain);
  std::vector<Tensor> x = inputs(1, 3, 3, 4, 1);
  x[1] = random({2, 3, 3}, 1);
  s.error("n differs", x, plain);
  x[1] = random({1, 3, 2}, 1);
  s.error("two coordinates", x, plain);
  x = inputs(1, 3, 3, 4, 1);
  x[4] = random({3, 3}, 1);
  s.error("c differs", x, plain);
  x = inputs(1, 3, 3, 4, 1);
  x[3] = x[3].cast(DType::f32);
  s.error("two dtypes", x, plain);
  s.random = [plain, with_relu](Rng& rng) {
    const int64_t v = random_size(rng, 1, 6);
    return Sample{"",
                  inputs(random_size(rng, 1, 3), rng.below(2) ? v : 1, v, random_size(rng, 1, 20),
                         rng.below(1000)),
                  rng.below(2) ? plain : with_relu};
  };
  t.push_back(s);
}

}  // namespace restage::gradcheck
