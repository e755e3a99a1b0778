#include <set>

#include "autograd/gradcheck/samples.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage::gradcheck {
namespace {

constexpr int64_t kRows = 900, kCols = 57;  // several pieces of work

OpSamples reshape_samples() {
  OpSamples s = samples_for<Reshape>();
  const auto to = [](const Shape& shape) {
    return Build([shape](Args x) { return reshape(x[0], shape); });
  };
  s.add("[2, 6] to [3, 4]", {random({2, 6}, 1)}, to({3, 4}));
  s.add("one size open", {random({2, 3, 4}, 2)}, to({-1, 4}));
  s.add("[1] to []", {random({1}, 3)}, to({}));
  s.add("[2, 0] to [0, 5]", {random({2, 0}, 4)}, to({0, 5}));
  s.add("[0, 3] with an open size", {random({0, 3}, 5)}, to({0, -1}));
  s.large("many", {random({kRows, kCols}, 6)}, to({kRows * kCols}));
  s.error("other count", {random({2, 3}, 1)}, to({4}));
  s.error("two open sizes", {random({2, 3}, 1)}, to({-1, -1}));
  s.error("no whole number", {random({2, 3}, 1)}, to({4, -1}));
  s.error("nothing to divide", {random({2, 3}, 1)}, to({0, -1}));
  s.random = [to](Rng& rng) {
    const int64_t a = random_size(rng, 1, 4), b = random_size(rng, 0, 4),
                  c = random_size(rng, 1, 4);
    return Sample{"", {random({a, b, c}, rng)}, rng.below(2) ? to({c, a * b}) : to({b, -1, c, 1})};
  };
  return s;
}

OpSamples permute_samples() {
  OpSamples s = samples_for<Permute>();
  const auto by = [](const Axes& order) {
    return Build([order](Args x) { return permute(x[0], order); });
  };
  s.add("transposed", {random({2, 3}, 1)}, by({1, 0}));
  s.add("cycle", {random({2, 3, 4}, 2)}, by({2, 0, 1}));
  s.add("rows stay", {random({2, 3, 4}, 3)}, by({1, 0, 2}));
  s.add("four axes", {random({2, 1, 3, 2}, 4)}, by({3, 1, 0, 2}));
  s.add("[1]", {random({1}, 5)}, by({0}));
  s.add("[]", {random({}, 6)}, by({}));
  s.add("[0, 2]", {random({0, 2}, 7)}, by({1, 0}));
  s.large("many", {random({kRows, kCols}, 8)}, by({1, 0}));
  s.error("axis twice", {random({2, 3}, 1)}, by({0, 0}));
  s.error("axis missing", {random({2, 3}, 1)}, by({0}));
  s.error("no such axis", {random({2, 3}, 1)}, by({0, 2}));
  s.random = [by](Rng& rng) {
    const Shape shape = random_shape(rng, 1, 5, 3);
    Axes order;
    for (int i = 0; i < shape.rank(); ++i) {
      order.push_back(i);
      std::swap(order[rng.below(order.size())], order[order.size() - 1]);
    }
    return Sample{"", {random(shape, rng)}, by(order)};
  };
  return s;
}

OpSamples slice_samples() {
  OpSamples s = samples_for<Slice>();
  const auto part = [](int axis, int64_t from, int64_t to) {
    return Build([=](Args x) { return slice(x[0], axis, from, to); });
  };
  s.add("middle", {random({2, 5, 3}, 1)}, part(1, 1, 4));
  s.add("last axis", {random({2, 5}, 2)}, part(-1, 3, 5));
  s.add("all of [1]", {random({1}, 3)}, part(0, 0, 1));
  s.add("nothing", {random({2, 3}, 4)}, part(1, 2, 2)).zero_gradient = true;
  s.add("[0, 4]", {random({0, 4}, 5)}, part(1, 1, 3));
  s.large("many", {random({kRows, kCols}, 6)}, part(1, 3, 50));
  s.error("beyond the end", {random({2, 3}, 1)}, part(1, 1, 4));
  s.error("backwards", {random({2, 3}, 1)}, part(1, 2, 1));
  s.error("negative", {random({2, 3}, 1)}, part(1, -1, 1));
  s.error("no such axis", {random({2, 3}, 1)}, part(2, 0, 1));
  s.random = [part](Rng& rng) {
    const Shape shape = random_shape(rng, 1, 4);
    const int axis = static_cast<int>(rng.below(static_cast<uint64_t>(shape.rank())));
    const int64_t from = random_size(rng, 0, shape[axis]), to = random_size(rng, from, shape[axis]);
    Sample sample{"", {random(shape, rng)}, part(axis, from, to)};
    sample.zero_gradient = from == to && shape.numel() > 0;
    return sample;
  };
  return s;
}

OpSamples split_samples() {
  OpSamples s = samples_for<Split>();
  /// The parts, each times another number and without those in `unused`, in reverse order.
  const auto parts = [](int axis, const std::vector<int64_t>& sizes, std::set<size_t> unused = {}) {
    return Build([=](Args x) {
      Split op{axis, {}};
      for (const int64_t size : sizes) op.sizes.push_back(size);
      const Vars y = call(op, {x[0]});
      std::vector<Var> used;
      for (size_t i = y.size(); i-- > 0;)
        if (!unused.contains(i)) used.push_back(scale(y[i], static_cast<double>(i + 1)));
      return concat(std::span<const Var>(used), axis);
    });
  };
  s.add("middle axis", {random({2, 6, 3}, 1)}, parts(1, {1, 3, 2}));
  s.add("last axis", {random({2, 5}, 2)}, parts(-1, {4, 1}));
  s.add("one part of [1]", {random({1}, 3)}, parts(0, {1}));
  s.add("an empty part", {random({3, 2}, 4)}, parts(0, {2, 0, 1}));
  s.add("a part that nobody uses", {random({2, 6}, 5)}, parts(1, {1, 2, 3}, {1}));
  s.add("the first part alone", {random({2, 6}, 5)}, parts(1, {1, 2, 3}, {1, 2}));
  s.add("[0, 4]", {random({0, 4}, 6)}, parts(1, {1, 3}));
  s.large("many", {random({kRows, kCols}, 7)}, parts(1, {3, kCols - 10, 7}));
  s.error("too little", {random({2, 3}, 1)}, parts(1, {1, 1}));
  s.error("too much", {random({2, 3}, 1)}, parts(1, {2, 2}));
  s.error("a negative size", {random({2, 3}, 1)}, parts(1, {4, -1}));
  s.error("no parts", {random({2, 0}, 1)}, parts(1, {}));
  s.error("no such axis", {random({2, 3}, 1)}, parts(2, {1}));
  s.random = [parts](Rng& rng) {
    const Shape shape = random_shape(rng, 1, 4);
    const int axis = static_cast<int>(rng.below(static_cast<uint64_t>(shape.rank())));
    std::vector<int64_t> sizes;
    int64_t left = shape[axis];
    for (int i = 0; i < 3; ++i) left -= sizes.emplace_back(random_size(rng, 0, left));
    sizes.push_back(left);
    return Sample{"", {random(shape, rng)}, parts(axis, sizes)};
  };
  return s;
}

OpSamples concat_samples() {
  OpSamples s = samples_for<Concat>();
  const auto along = [](int axis) {
    return Build([axis](Args x) { return call(Concat{axis}, std::span<const Var>(x)); });
  };
  s.add("rows", {random({2, 3}, 1), random({1, 3}, 2), random({2, 3}, 3)}, along(0));
  s.add("columns", {random({2, 3}, 1), random({2, 1}, 2)}, along(-1));
  s.add("middle", {random({2, 3, 2}, 1), random({2, 2, 2}, 2)}, along(1));
  s.add("one", {random({2}, 1)}, along(0));
  s.add("with an empty one", {random({0, 3}, 1), random({2, 3}, 2)}, along(0));
  s.add("all empty", {random({2, 0}, 1), random({2, 0}, 2)}, along(1));
  s.large("many", {random({kRows, kCols}, 1), random({kRows, 3}, 2)}, along(1));
  s.error("other sizes", {random({2, 3}, 1), random({3, 2}, 2)}, along(0));
  s.error("other ranks", {random({2, 3}, 1), random({3}, 2)}, along(0));
  s.error("no such axis", {random({2, 3}, 1), random({2, 3}, 2)}, along(2));
  s.error("two dtypes", {random({2}, 1), random({2}, 2).cast(DType::f32)}, along(0));
  s.error("nothing", {}, along(0));
  s.error("too many", std::vector<Tensor>(17, random({1}, 1)), along(0));
  s.random = [along](Rng& rng) {
    Shape shape = random_shape(rng, 1, 4, 3);
    const int axis = static_cast<int>(rng.below(static_cast<uint64_t>(shape.rank())));
    Sample sample{"", {}, along(axis)};
    for (int64_t i = random_size(rng, 1, 4); i > 0; --i) {
      shape.set(axis, random_size(rng, 0, 3));
      sample.inputs.push_back(random(shape, rng));
    }
    return sample;
  };
  return s;
}

OpSamples gather_samples() {
  OpSamples s = samples_for<Gather>();
  const auto at = [](const Tensor& index) {
    return Build([index](Args x) { return gather(x[0], index.to(x[0].value.device())); });
  };
  Rng rng(RngKey{24, 0});
  s.add("repeated rows", {random({2, 3, 2}, 1)}, at(i32({2, 4}, {0, 2, 2, 2, 1, 1, 0, 0})));
  s.add("neighbourhoods", {random({1, 4, 3}, 2)}, at(i32({1, 2, 3}, {3, 0, 3, 1, 1, 2})));
  s.add("one row", {random({1, 1, 1}, 3)}, at(i32({1, 1}, {0})));
  s.add("no index", {random({2, 3, 2}, 4)}, at(i32({2, 0}, {}))).zero_gradient = true;
  s.add("no sample", {random({0, 3, 2}, 5)}, at(i32({0, 4}, {})));
  s.add("no column", {random({1, 3, 0}, 6)}, at(i32({1, 2}, {0, 1})));
  s.large("many", {random({3, 70, 130}, 7)}, at(random_index({3, 90, 2}, rng, 70)));
  s.error("beyond the end", {random({1, 3, 2}, 1)}, at(i32({1, 1}, {3})));
  s.error("negative", {random({1, 3, 2}, 1)}, at(i32({1, 1}, {-1})));
  s.error("other samples", {random({2, 3, 2}, 1)}, at(i32({1, 1}, {0})));
  s.error("two axes", {random({3, 2}, 1)}, at(i32({3, 1}, {0, 0, 0})));
  s.error("index of one axis", {random({2, 3, 2}, 1)}, at(i32({2}, {0, 0})));
  s.error("floating index", {random({1, 3, 2}, 1)}, at(f64({1, 1}, {0})));
  s.random = [at](Rng& r) {
    const Shape x{random_size(r, 1, 3), random_size(r, 1, 4), random_size(r, 1, 4)};
    const Shape index = r.below(2) ? Shape{x[0], random_size(r, 1, 5)}
                                   : Shape{x[0], random_size(r, 1, 3), random_size(r, 1, 3)};
    return Sample{"", {random(x, r)}, at(random_index(index, r, x[1]))};
  };
  return s;
}

OpSamples scatter_samples() {
  OpSamples s = samples_for<ScatterAdd>();
  const auto into = [](const Tensor& index, int64_t rows) {
    return Build(
        [index, rows](Args x) { return scatter_add(x[0], index.to(x[0].value.device()), rows); });
  };
  Rng rng(RngKey{25, 0});
  s.add("repeated rows", {random({2, 3, 2}, 1)}, into(i32({2, 3}, {0, 3, 0, 1, 1, 1}), 4));
  s.add("one row", {random({1, 1, 1}, 2)}, into(i32({1, 1}, {0}), 1));
  s.add("nothing to add", {random({1, 0, 2}, 3)}, into(i32({1, 0}, {}), 3));
  s.add("no sample", {random({0, 2, 2}, 4)}, into(i32({0, 2}, {}), 3));
  s.large("many", {random({3, 150, 130}, 5)}, into(random_index({3, 150}, rng, 40), 40));
  s.error("beyond the end", {random({1, 1, 2}, 1)}, into(i32({1, 1}, {3}), 3));
  s.error("no rows", {random({1, 1, 2}, 1)}, into(i32({1, 1}, {0}), 0));
  s.error("negative rows", {random({1, 1, 2}, 1)}, into(i32({1, 1}, {0}), -1));
  s.error("other count", {random({1, 2, 2}, 1)}, into(i32({1, 3}, {0, 0, 0}), 3));
  s.error("index of three axes", {random({1, 1, 2}, 1)}, into(i32({1, 1, 1}, {0}), 3));
  s.random = [into](Rng& r) {
    const int64_t rows = random_size(r, 1, 4);
    const Shape x{random_size(r, 1, 3), random_size(r, 1, 5), random_size(r, 1, 4)};
    return Sample{"", {random(x, r)}, into(random_index({x[0], x[1]}, r, rows), rows)};
  };
  return s;
}

OpSamples unfold_samples() {
  OpSamples s = samples_for<Unfold>();
  const auto windows = [](int64_t k, int64_t stride, int64_t pad, int64_t steps) {
    return Build([=](Args x) { return call(Unfold{k, stride, pad, steps}, {x[0]}); });
  };
  s.add("overlapping", {random({2, 5, 3}, 1)}, windows(3, 1, 1, 5));
  s.add("strided", {random({1, 7, 2}, 2)}, windows(4, 2, 1, 3));
  s.add("beyond both ends", {random({1, 2, 2}, 3)}, windows(5, 1, 2, 4));
  s.add("one", {random({1, 1, 1}, 4)}, windows(1, 1, 0, 1));
  s.add("empty sequence", {random({1, 0, 2}, 5)}, windows(3, 1, 1, 2));
  s.add("no step", {random({1, 4, 2}, 6)}, windows(3, 1, 1, 0)).zero_gradient = true;
  s.large("many", {random({4, 120, 33}, 7)}, windows(3, 2, 1, 60));
  s.error("two axes", {random({4, 2}, 1)}, windows(3, 1, 1, 4));
  s.error("kernel of 0", {random({1, 4, 2}, 1)}, windows(0, 1, 1, 4));
  s.error("stride of 0", {random({1, 4, 2}, 1)}, windows(3, 0, 1, 4));
  s.error("negative steps", {random({1, 4, 2}, 1)}, windows(3, 1, 1, -1));
  s.random = [windows](Rng& r) {
    const int64_t k = random_size(r, 1, 4);
    const Shape x{random_size(r, 1, 2), random_size(r, 1, 6), random_size(r, 1, 3)};
    return Sample{
        "", {random(x, r)}, windows(k, random_size(r, 1, 3), random_size(r, 0, k - 1), 4)};
  };
  return s;
}

OpSamples conv1d_samples() {
  OpSamples s{"conv1d", "x[n, l, c], W[o, c, k], b[o]"};
  const auto conv = [](int64_t stride, int64_t pad, int64_t steps) {
    return Build([=](Args x) { return conv1d(x[0], x[1], x[2], stride, pad, steps); });
  };
  const auto inputs = [](const Shape& x, int64_t out, int64_t k) {
    return std::vector<Tensor>{random(x, 71), random({out, x[2], k}, 72), random({out}, 73)};
  };
  s.add("same length", inputs({2, 5, 3}, 4, 3), conv(1, 1, 5));
  s.add("strided", inputs({1, 7, 2}, 3, 4), conv(2, 1, 3));
  s.add("one", inputs({1, 1, 1}, 1, 1), conv(1, 0, 1));
  s.add("no sequence", inputs({0, 4, 2}, 2, 3), conv(1, 1, 4)).zero_gradient = true;
  s.large("many", inputs({5, 90, 20}, 40, 3), conv(1, 1, 90));
  s.error("c differs", {random({1, 4, 2}, 1), random({3, 3, 3}, 2), random({3}, 3)}, conv(1, 1, 4));
  s.error("o differs", {random({1, 4, 2}, 1), random({3, 2, 3}, 2), random({2}, 3)}, conv(1, 1, 4));
  s.error("matrix as weight", {random({1, 4, 2}, 1), random({3, 2}, 2), random({3}, 3)},
          conv(1, 1, 4));
  s.random = [conv, inputs](Rng& r) {
    const int64_t k = random_size(r, 1, 4);
    const Shape x{random_size(r, 1, 2), random_size(r, 1, 6), random_size(r, 1, 3)};
    return Sample{"", inputs(x, random_size(r, 1, 3), k),
                  conv(random_size(r, 1, 3), random_size(r, 0, k - 1), 4)};
  };
  return s;
}

}  // namespace

void add_layout(Table& t) {
  t.push_back(reshape_samples());
  t.push_back(permute_samples());
  t.push_back(slice_samples());
  t.push_back(split_samples());
  t.push_back(concat_samples());
  t.push_back(gather_samples());
  t.push_back(scatter_samples());
  t.push_back(unfold_samples());
  t.push_back(conv1d_samples());
}

}  // namespace restage::gradcheck
