#include "autograd/gradcheck/samples.h"
#include "autograd/ops/swing.h"

namespace restage::gradcheck {
namespace {

/// A hip with two legs and a spine that carries a head: all kinds of joints.
const std::vector<SwingJoint> kTree = {{-1, 3, 1, 2},  {0, 4, -1, -1},  {0, 5, -1, -1},
                                       {0, 6, -1, -1}, {1, -1, -1, -1}, {2, -1, -1, -1},
                                       {3, -1, -1, -1}};

std::vector<Tensor> skeletons(int64_t n, int64_t j, Rng& rng) {
  return {random({n, j, 3}, rng), random({n, j, 3}, rng), random({n, j}, rng)};
}

/// Poses near the rest pose, so that no arc comes near half a turn.
std::vector<Tensor> near_rest(int64_t n, int64_t j, Rng& rng) {
  std::vector<Tensor> out = skeletons(n, j, rng);
  for (int64_t i = 0; i < out[0].numel(); ++i)
    out[1].data<double>()[i] = out[0].data<double>()[i] + 0.2 * out[1].data<double>()[i];
  return out;
}

Build along(std::vector<SwingJoint> joints) {
  return [joints](Args x) { return swing_twist(x[0], x[1], x[2], joints); };
}

}  // namespace

void add_swing(Table& t) {
  OpSamples s = samples_for<SwingTwist>();
  const Build build = along(kTree);
  Rng rng(RngKey{29, 0});
  s.add("all kinds of joints", skeletons(3, 7, rng), build);
  s.add("none", skeletons(0, 7, rng), build);
  s.add("a chain", skeletons(2, 3, rng), along({{-1, 1, -1, -1}, {0, 2, -1, -1}, {1, -1, -1, -1}}));
  s.add("one leaf", skeletons(2, 1, rng), along({{-1, -1, -1, -1}})).zero_gradient = true;
  std::vector<Tensor> still = skeletons(2, 7, rng);
  still[1] = still[0].clone();
  s.add("as at rest", still, build);
  const std::vector<SwingJoint> bone = {{-1, 1, -1, -1}, {0, -1, -1, -1}};
  const Tensor rest = f64({1, 2, 3}, {0, 0, 0, 0, 1, 0}), none = f64({1, 2}, {0, 0});
  const Tensor zero3 = Tensor::zeros({1, 2, 3}, DType::f64);
  s.add("stretched", {rest, f64({1, 2, 3}, {1, 1, 1, 1, 3, 1}), f64({1, 2}, {.3, .1})},
        along(bone));
  s.add("nearly reversed", {rest, f64({1, 2, 3}, {0, 0, 0, .2, -1, 0}), none}, along(bone));
  s.kink("no bone: the parent's rotation, no gradient", {rest, zero3, none}, along(bone),
         {zero3, zero3, Tensor::zeros({1, 2}, DType::f64)});
  s.large("many frames", skeletons(120, 7, rng), build);
  const auto broken = [&](const std::string& title, size_t which, const Shape& shape) {
    std::vector<Tensor> inputs = skeletons(2, 7, rng);
    inputs[which] = random(shape, 1);
    s.error(title, inputs, build);
  };
  broken("rest of another n", 0, {1, 7, 3});
  broken("posed of another j", 1, {2, 6, 3});
  broken("twist of another n", 2, {1, 7});
  broken("twist of another j", 2, {2, 6});
  broken("points in the plane", 0, {2, 7, 2});
  s.error("a parent after its child", skeletons(1, 2, rng),
          along({{1, -1, -1, -1}, {-1, 0, -1, -1}}));
  s.error("a child that is not there", skeletons(1, 1, rng), along({{-1, 1, -1, -1}}));
  std::vector<Tensor> mixed = skeletons(1, 7, rng);
  mixed[2] = mixed[2].cast(DType::f32);
  s.error("two dtypes", mixed, build);
  s.random = [build](Rng& r) { return Sample{"", near_rest(random_size(r, 1, 3), 7, r), build}; };
  t.push_back(s);
}

}  // namespace restage::gradcheck
