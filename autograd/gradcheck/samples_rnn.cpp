#include "autograd/gradcheck/samples.h"
#include "autograd/ops/rnn.h"

namespace restage::gradcheck {
namespace {

std::vector<Tensor> gru_inputs(int64_t t, int64_t n, int64_t i, int64_t h, Rng& rng) {
  return {random({t, n, i}, rng),  random({n, h}, rng),  random({3 * h, i}, rng),
          random({3 * h, h}, rng), random({3 * h}, rng), random({3 * h}, rng)};
}

std::vector<Tensor> recurrence_inputs(int64_t n, int64_t t, int64_t m, Rng& rng) {
  return {random({n, t, m}, rng), random({n, t, m}, rng), random({n, m}, rng)};
}

void add_recurrence(Table& table) {
  OpSamples s = samples_for<Recurrence>();
  const Build build = [](Args x) { return recurrence(x[0], x[1], x[2]); };
  Rng rng(RngKey{29, 0});
  s.add("four steps", recurrence_inputs(2, 4, 3, rng), build);
  s.add("one of everything", recurrence_inputs(1, 1, 1, rng), build);
  s.add("no step", recurrence_inputs(2, 0, 3, rng), build).zero_gradient = true;
  s.add("no row", recurrence_inputs(0, 3, 2, rng), build).zero_gradient = true;
  s.large("many rows", recurrence_inputs(70, 9, 118, rng), build);
  const auto broken = [&](const std::string& title, size_t which, const Shape& shape) {
    std::vector<Tensor> inputs = recurrence_inputs(2, 3, 4, rng);
    inputs[which] = random(shape, 1);
    s.error(title, inputs, build);
  };
  broken("a of two axes", 0, {2, 4});
  broken("b differs", 1, {2, 3, 5});
  broken("n differs", 2, {3, 4});
  broken("m differs", 2, {2, 5});
  std::vector<Tensor> mixed = recurrence_inputs(2, 3, 4, rng);
  mixed[1] = mixed[1].cast(DType::f32);
  s.error("two dtypes", mixed, build);
  std::vector<Tensor> integers;
  for (const Tensor& in : recurrence_inputs(1, 1, 1, rng)) integers.push_back(in.cast(DType::i32));
  s.error("integers", integers, build);
  s.random = [build](Rng& r) {
    return Sample{
        "", recurrence_inputs(random_size(r, 1, 4), random_size(r, 1, 4), random_size(r, 1, 5), r),
        build};
  };
  table.push_back(s);
}

}  // namespace

void add_rnn(Table& table) {
  add_recurrence(table);
  OpSamples s = samples_for<Gru>();
  const Build build = [](Args x) { return gru(x[0], x[1], x[2], x[3], x[4], x[5]); };
  Rng rng(RngKey{23, 0});
  s.add("three steps", gru_inputs(3, 2, 4, 3, rng), build);
  s.add("one of everything", gru_inputs(1, 1, 1, 1, rng), build);
  s.add("no step", gru_inputs(0, 2, 3, 2, rng), build).zero_gradient = true;
  s.add("no sequence", gru_inputs(3, 0, 3, 2, rng), build).zero_gradient = true;
  s.add("no input number", gru_inputs(2, 2, 0, 2, rng), build);
  s.large("many sequences", gru_inputs(3, 290, 5, 32, rng), build);
  s.large("a frame: weights read as they lie", gru_inputs(1, 2, 69, 320, rng), build);
  s.large("a frame of units that fill no block", gru_inputs(1, 3, 8, 70, rng), build);
  s.large("rows and units that fill no panel", gru_inputs(2, 14, 3, 70, rng), build);
  const auto broken = [&](const std::string& title, size_t which, const Shape& shape) {
    std::vector<Tensor> inputs = gru_inputs(2, 3, 4, 5, rng);
    inputs[which] = random(shape, 1);
    s.error(title, inputs, build);
  };
  broken("x of two axes", 0, {2, 4});
  broken("n differs", 1, {2, 5});
  broken("i differs", 2, {15, 3});
  broken("h differs in w_ih", 2, {14, 4});
  broken("h differs in w_hh", 3, {15, 4});
  broken("h differs in b_ih", 4, {14});
  broken("h differs in b_hh", 5, {5});
  std::vector<Tensor> mixed = gru_inputs(2, 3, 4, 5, rng);
  mixed[3] = mixed[3].cast(DType::f32);
  s.error("two dtypes", mixed, build);
  std::vector<Tensor> integers;
  for (const Tensor& in : gru_inputs(1, 1, 1, 1, rng)) integers.push_back(in.cast(DType::i32));
  s.error("integers", integers, build);
  s.random = [build](Rng& r) {
    return Sample{"",
                  gru_inputs(random_size(r, 1, 4), random_size(r, 1, 3), random_size(r, 1, 4),
                             random_size(r, 1, 4), r),
                  build};
  };
  table.push_back(s);
}

}  // namespace restage::gradcheck
