#include <algorithm>
#include <cmath>

#include "autograd/gradcheck/samples.h"
#include "autograd/ops/elementwise.h"

namespace restage::gradcheck {
namespace {

constexpr int64_t kMany = 50001;  // several pieces of work, the last one odd

/// Where a function may be sampled: positive ones for log and sqrt, away from 0 at kinks.
enum class Domain { all, positive, no_zero };

Tensor in_domain(const Shape& shape, Rng& rng, Domain domain) {
  Tensor t = random(shape, rng, domain == Domain::no_zero ? 0.1 : 0);
  if (domain == Domain::positive)
    for (int64_t i = 0; i < t.numel(); ++i)
      t.data<double>()[i] = 0.5 + std::abs(t.data<double>()[i]);
  return t;
}

bool all_negative(const Tensor& t) {
  return std::all_of(t.data<double>(), t.data<double>() + t.numel(),
                     [](double v) { return v < 0; });
}

template <Unary U>
OpSamples unary(Domain domain, double number = 0) {
  OpSamples s = samples_for<UnaryOp<U>>();
  const Build build = [number](Args x) { return call(UnaryOp<U>{number}, {x[0]}); };
  Rng rng(RngKey{21, 0});
  s.add("[3, 4]", {in_domain({3, 4}, rng, domain)}, build);
  s.add("[1]", {Tensor::full({1}, 0.7, DType::f64)}, build);
  s.add("one number without axes", {Tensor::full({}, 0.6, DType::f64)}, build);
  s.add("[2, 0, 3]", {Tensor::zeros({2, 0, 3}, DType::f64)}, build);
  for (const int64_t n : {7, 8, 17, 33})  // whole vectors and rests
    s.add("[" + std::to_string(n) + "]", {in_domain({n}, rng, domain)}, build);
  s.large("many", {in_domain({kMany}, rng, domain)}, build);
  s.error("integers", {i32({2}, {1, 2})}, build);
  s.random = [build, domain](Rng& r) {
    Sample sample{"", {in_domain(random_shape(r, 0, 4), r, domain)}, build};
    // The only function here that is flat somewhere.
    sample.zero_gradient = U == Unary::relu && all_negative(sample.inputs[0]);
    return sample;
  };
  return s;
}

/// The nearest multiples of 1/64, moved by `offset`.
Tensor on_grid(Tensor t, double offset) {
  for (int64_t i = 0; i < t.numel(); ++i)
    t.data<double>()[i] = std::round(64 * t.item(i)) / 64 + offset;
  return t;
}

template <Binary B>
OpSamples binary(Domain domain) {
  OpSamples s = samples_for<BinaryOp<B>>();
  const Build build = [](Args x) { return call(BinaryOp<B>{}, {x[0], x[1]}); };
  Rng rng(RngKey{31, 0});
  const auto numbers = [domain](const Shape& shape, Rng& from) {  // the first ones
    return domain == Domain::all ? random(shape, from, 0.5) : in_domain(shape, from, domain);
  };
  const auto first = [&](const Shape& shape) { return numbers(shape, rng); };
  const auto pair = [&](const Shape& a, const Shape& b) {
    s.add(a.str() + " " + b.str(), {first(a), random(b, rng, 0.5)}, build);
  };
  pair({3, 4}, {3, 4});
  pair({3, 1}, {1, 4});
  pair({2, 3, 4}, {4});
  pair({4}, {2, 3, 4});
  pair({2, 3, 4}, {3, 1});
  pair({2, 1, 4, 1}, {3, 1, 5});
  pair({1}, {1});
  pair({}, {2, 2});
  pair({1, 1, 1}, {2});
  pair({0, 3}, {3});
  pair({0, 3}, {1, 1});
  pair({1, 0}, {4, 1});
  // So many pairs, and none within a difference's step of equal numbers, where minima have a kink.
  s.large("many rows", {on_grid(first({700, 73}), 1.0 / 128), on_grid(random({73}, rng, 0.5), 0)},
          build);
  s.error("sizes 3 and 4", {random({2, 3}, 1), random({2, 4}, 1)}, build);
  s.error("sizes 0 and 2", {random({0}, 1), random({2}, 1)}, build);
  s.error("two dtypes", {random({2}, 1), random({2}, 1).cast(DType::f32)}, build);
  s.error("integers", {i32({1}, {1}), i32({1}, {1})}, build);
  s.random = [build, numbers](Rng& r) {
    const Shape out = random_shape(r, 1, 4);
    const auto part = [&] {  // drops leading axes, sets others to 1
      Shape shape;
      for (int i = static_cast<int>(r.below(static_cast<uint64_t>(out.rank()))); i < out.rank();
           ++i)
        shape.push_back(r.below(3) == 0 ? 1 : out[i]);
      return shape;
    };
    const Shape a = part(), b = part();
    Tensor x = numbers(a, r);
    return Sample{"", {x, random(b, r, 0.5)}, build};
  };
  return s;
}

OpSamples expand_samples() {
  OpSamples s = samples_for<Expand>();
  const auto to = [](const Shape& shape) {
    return Build([shape](Args x) { return expand(x[0], shape); });
  };
  s.add("[3, 1] to [2, 3, 4]", {random({3, 1}, 1)}, to({2, 3, 4}));
  s.add("[1] to [5]", {random({1}, 2)}, to({5}));
  s.add("[] to [2, 2]", {random({}, 3)}, to({2, 2}));
  s.add("[2, 3] to itself", {random({2, 3}, 4)}, to({2, 3}));
  s.add("[1, 3] to [0, 3]", {random({1, 3}, 5)}, to({0, 3})).zero_gradient = true;
  s.add("[0, 1] to [0, 3]", {random({0, 1}, 6)}, to({0, 3}));
  s.large("many", {random({300, 1, 9}, 6)}, to({300, 21, 9}));
  s.error("[3] to [4]", {random({3}, 1)}, to({4}));
  s.error("[2, 2] to [2]", {random({2, 2}, 1)}, to({2}));
  s.random = [to](Rng& rng) {
    const Shape out = random_shape(rng, 1, 4);
    Shape in;
    for (int i = static_cast<int>(rng.below(2)); i < out.rank(); ++i)
      in.push_back(rng.below(2) ? 1 : out[i]);
    Sample sample{"", {random(in, rng)}, to(out)};
    sample.zero_gradient = out.numel() == 0 && in.numel() > 0;
    return sample;
  };
  return s;
}

OpSamples dropout_samples() {
  OpSamples s = samples_for<Dropout>();
  const auto with = [](double p) {
    return Build([p](Args x) { return call(Dropout{p, RngKey{5, 6}}, {x[0]}); });
  };
  s.add("half of [5, 7]", {random({5, 7}, 1)}, with(0.5));
  s.add("none of [1]", {random({1}, 2)}, with(0));
  s.add("[0, 3]", {random({0, 3}, 3)}, with(0.5));
  s.large("many", {random({kMany}, 4)}, with(0.2));
  const Build of_relu = [](Args x) { return relu_dropout(x[0], 0.2, RngKey{5, 6}); };
  Rng fixed(RngKey{6, 0});
  for (const Shape& shape : {Shape{5, 7}, Shape{4, 1}, Shape{0, 3}})
    s.add("of relu of " + shape.str(), {random(shape, fixed, 0.05)}, of_relu);
  s.large("many of relu", {random({kMany}, fixed, 0.05)}, of_relu);
  s.error("p = 1", {random({3}, 1)}, with(1.0));
  s.error("p < 0", {random({3}, 1)}, with(-0.1));
  s.error("integers", {i32({1}, {1})}, with(0.5));
  s.random = [with](Rng& rng) {
    Shape shape = random_shape(rng, 1, 3);
    shape.push_back(16);  // some of sixteen survive
    return Sample{"", {random(shape, rng)}, with(0.4)};
  };
  return s;
}

}  // namespace

void add_elementwise(Table& t) {
#define RESTAGE_SAMPLES(name, help, kept, domain, ...) \
  t.push_back(unary<Unary::name>(Domain::domain));
  RESTAGE_UNARY(RESTAGE_SAMPLES)
#undef RESTAGE_SAMPLES
#define RESTAGE_SAMPLES(name, number, tried, help, kept, domain, ...) \
  t.push_back(unary<Unary::name>(Domain::domain, tried));
  RESTAGE_UNARY_WITH_NUMBER(RESTAGE_SAMPLES)
#undef RESTAGE_SAMPLES
  const auto of = [&](const std::string& op) -> OpSamples& {
    return *std::find_if(t.begin(), t.end(), [&](const OpSamples& s) { return s.op == op; });
  };
  of("abs").kink("abs at 0 has derivative 0", {f64({3}, {0.0, -0.0, 2})},
                 [](Args x) { return abs(x[0]); }, {f64({3}, {0, 0, 1})});
  of("relu").kink("relu at 0 has derivative 0", {f64({4}, {0.0, -0.0, 2, -2})},
                  [](Args x) { return relu(x[0]); }, {f64({4}, {0, 0, 1, 0})});
  of("leaky_relu")
      .kink("leaky relu at 0 has the slope of its negative side", {f64({3}, {0.0, 2, -2})},
            [](Args x) { return leaky_relu(x[0], 0.2); }, {f64({3}, {0.2, 1, 0.2})});
  const Tensor far = f64({4}, {-700, -30, 30, 700});
  of("sigmoid").add("far out", {far}, [](Args x) { return sigmoid(x[0]); });
  of("softplus").add("far out", {far}, [](Args x) { return softplus(x[0]); });
#define RESTAGE_SAMPLES(name, a, b, help, domain, ...) \
  t.push_back(binary<Binary::name>(Domain::domain));
  RESTAGE_BINARY(RESTAGE_SAMPLES)
#undef RESTAGE_SAMPLES
  const Tensor ones = f64({2}, {3, -3}), zeros = f64({2}, {0, 0}), full = f64({2}, {1, 1});
  of("minimum").kink("of equal ones", {ones, ones.clone()},
                     [](Args x) { return minimum(x[0], x[1]); }, {full, zeros});
  of("maximum").kink("of equal ones", {ones, ones.clone()},
                     [](Args x) { return maximum(x[0], x[1]); }, {full, zeros});
  of("pow").kink("of no positive number", {f64({2}, {0, -2}), f64({2}, {2, 3})},
                 [](Args x) { return pow(x[0], x[1]); }, {f64({2}, {0, 12}), zeros});
  of("prelu").kink(
      "at 0 it has the slope of its negative side", {f64({3}, {0, 2, -2}), f64({1}, {0.25})},
      [](Args x) { return prelu(x[0], x[1]); }, {f64({3}, {0.25, 1, 0.25}), f64({1}, {-2})});
  const Build angle = [](Args x) { return atan2(x[0], x[1]); };
  of("atan2").add("all quadrants and axes",
                  {f64({7}, {1, 2, -1, -3, 1, -1, 0}), f64({7}, {2, -1, -3, 1, 0, 0, 2})}, angle);
  of("atan2").add("far and near", {f64({3}, {300, 1e-2, -2e-2}), f64({3}, {-50, 2e-2, 1e-2})},
                  angle);
  const Tensor none = f64({4}, {0, 0, 0, 0});
  of("atan2").kink("at the origin both derivatives are 0",
                   {f64({4}, {0.0, -0.0, 0.0, 1e-7}), f64({4}, {0.0, 0.0, -0.0, -1e-7})}, angle,
                   {none, none});
  t.push_back(expand_samples());
  t.push_back(dropout_samples());
}

}  // namespace restage::gradcheck
