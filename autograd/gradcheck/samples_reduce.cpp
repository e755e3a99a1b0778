#include "autograd/gradcheck/samples.h"
#include "autograd/ops/reduce.h"

namespace restage::gradcheck {
namespace {

using AxisOp = std::function<Var(const Var&, int)>;

/// Samples that every op along one axis shares. `empty_ok`: the axis itself may be empty.
void along_axis(OpSamples& s, const AxisOp& op, bool empty_ok, bool flat_if_single) {
  const auto on = [op](int axis) { return Build([op, axis](Args x) { return op(x[0], axis); }); };
  const auto add = [&](const Shape& shape, int axis) {
    s.add(shape.str() + " axis " + std::to_string(axis), {random(shape, 41)}, on(axis))
        .zero_gradient = flat_if_single && shape[axis] == 1;
  };
  add({3, 4}, 0);
  add({3, 4}, 1);
  add({2, 3, 4}, -2);
  add({2, 1, 4}, 1);
  add({5}, -1);
  add({1}, 0);
  add({17}, 0);
  add({0, 3}, 1);
  add({2, 3, 0}, 1);
  if (empty_ok) {
    add({2, 0, 3}, 1);
  } else {
    s.error("empty axis", {random({2, 0, 3}, 1)}, on(1));
  }
  // Numbers up to 26; partial sums round at 6e-8 of their size. All of these ops stay below 2.5e-7
  // of the largest result.
  s.large("many rows", {distinct({1001, 51})}, on(1)).f32_tolerance = 2e-6;
  s.large("many columns", {distinct({1203, 40})}, on(0)).f32_tolerance = 2e-6;
  s.error("no such axis", {random({2, 3}, 1)}, on(2));
  s.error("no such axis from the end", {random({2, 3}, 1)}, on(-3));
  s.error("integers", {i32({2}, {1, 2})}, on(0));
  s.random = [on, empty_ok, flat_if_single](Rng& rng) {
    Shape shape = random_shape(rng, 1, 4);
    const int axis = static_cast<int>(rng.below(static_cast<uint64_t>(shape.rank())));
    if (!empty_ok && shape[axis] == 0) shape.set(axis, 2);
    Sample sample{"", {random(shape, rng)}, on(axis)};
    sample.zero_gradient = flat_if_single && shape[axis] == 1 && shape.numel() > 0;
    return sample;
  };
}

OpSamples mean_samples() {
  OpSamples s{"mean", "x[... n ...]"};
  along_axis(
      s, [](const Var& x, int axis) { return mean(x, axis); }, false, false);
  return s;
}

OpSamples mse_samples() {
  OpSamples s{"mse", "a[...], b[...]"};
  const Build build = [](Args x) { return mse(x[0], x[1]); };
  s.add("[3, 4]", {random({3, 4}, 1), random({3, 4}, 2)}, build);
  s.add("[1]", {random({1}, 1), random({1}, 2)}, build);
  s.large("many", {random({300, 100}, 1), random({300, 100}, 2)}, build);
  s.error("nothing to average", {random({0, 3}, 1), random({0, 3}, 2)}, build);
  s.error("other shapes", {random({2, 3}, 1), random({3}, 2)}, build);
  s.random = [build](Rng& rng) {
    Shape shape = random_shape(rng, 1, 3);
    if (shape.numel() == 0) shape = {2};
    return Sample{"", {random(shape, rng), random(shape, rng)}, build};
  };
  return s;
}

OpSamples bce_samples() {
  OpSamples s{"bce_with_logits", "logits[...]"};
  const auto with = [](double label) {
    return Build([label](Args x) { return bce_with_logits(x[0], label); });
  };
  s.add("real", {random({5, 1}, 1)}, with(1));
  s.add("fake", {random({5, 1}, 1)}, with(0));
  s.add("smoothed", {random({5}, 1)}, with(0.9));
  s.add("far out", {f64({4}, {-80, -20, 20, 80})}, with(1));
  s.large("many", {random({40000}, 1)}, with(0.9));
  s.error("nothing to average", {random({0}, 1)}, with(1));
  s.random = [with](Rng& rng) {
    return Sample{"", {random({random_size(rng, 1, 9)}, rng)}, with(rng.uniform())};
  };
  return s;
}

}  // namespace

void add_reduce(Table& t) {
  t.push_back(samples_for<Sum>());
  along_axis(
      t.back(), [](const Var& x, int axis) { return sum(x, axis); }, true, false);
  t.push_back(samples_for<Max>());
  along_axis(
      t.back(), [](const Var& x, int axis) { return max(x, axis); }, false, false);
  t.back().kink("the first of equal maxima receives the gradient",
                {f64({2, 4}, {1, 3, 3, 0, -1, -1, -1, -1})}, [](Args x) { return max(x[0], 1); },
                {f64({2, 4}, {0, 1, 0, 0, 1, 0, 0, 0})});
  t.push_back(samples_for<Softmax>());
  along_axis(
      t.back(), [](const Var& x, int axis) { return softmax(x, axis); }, false, true);
  t.back().add("far apart", {f64({4}, {-800, 0, 700, 701})},
               [](Args x) { return softmax(x[0], 0); });
  t.push_back(mean_samples());
  t.push_back(mse_samples());
  t.push_back(bce_samples());
}

}  // namespace restage::gradcheck
