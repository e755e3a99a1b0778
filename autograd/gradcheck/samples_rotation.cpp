#include "autograd/gradcheck/samples.h"
#include "autograd/ops/rotation.h"

namespace restage::gradcheck {
namespace {

OpSamples to_matrix_samples() {
  OpSamples s = samples_for<ToMatrix>();
  const auto form = [](RotationForm f) {
    return Build([f](Args x) { return call(ToMatrix{f}, {x[0]}); });
  };
  const struct {
    RotationForm form;
    int64_t width;
    const char* name;
  } forms[] = {{RotationForm::sixd, 6, "6D"},
               {RotationForm::quaternion, 4, "quaternion"},
               {RotationForm::axis_angle, 3, "axis angle"}};
  for (const auto& f : forms) {
    const std::string name = f.name;
    s.add(name + " rows", {random({5, f.width}, 81)}, form(f.form));
    s.add(name + " one", {random({f.width}, 82)}, form(f.form));
    s.add(name + " sequence", {random({2, 1, 3, f.width}, 83)}, form(f.form));
    s.add(name + " none", {random({0, f.width}, 84)}, form(f.form));
    s.large(name + " many", {random({1300, f.width}, 85, 0.2)}, form(f.form));
    s.error(name + " of another width", {random({2, 5}, 1)}, form(f.form));
    s.error(name + " without axes", {random({}, 1)}, form(f.form));
  }
  s.add("6D far from unit length", {f64({2, 6}, {30, 1, 2, -5, 40, 3, .01, .02, 0, 0, .01, .03})},
        form(RotationForm::sixd));
  s.add("no turn at all", {Tensor::zeros({2, 3}, DType::f64)}, form(RotationForm::axis_angle));
  s.add("tiny turns", {f64({3, 3}, {1e-5, -2e-5, 0, 9e-5, 6e-5, 1e-5, 1e-3, 2e-3, -1e-3})},
        form(RotationForm::axis_angle));
  s.add("half and full turns", {f64({2, 3}, {3.14159265, 0, 0, 0, 6.28318, 0})},
        form(RotationForm::axis_angle));
  s.error("integers", {Tensor::zeros({1, 4}, DType::i32)}, form(RotationForm::quaternion));
  s.random = [form, forms](Rng& rng) {
    const auto& f = forms[rng.below(3)];
    Shape shape = random_shape(rng, 0, 2);
    shape.push_back(f.width);
    return Sample{"", {random(shape, rng, 0.2)}, form(f.form)};
  };
  return s;
}

std::vector<Tensor> fk_inputs(int64_t n, int64_t j, Rng& rng) {
  return {random({n, j, 3, 3}, rng), random({n, j, 3}, rng), random({n, 3}, rng)};
}

OpSamples fk_samples() {
  OpSamples s = samples_for<ForwardKinematics>();
  const auto tree = [](std::vector<int> parents) {
    return Build([parents](Args x) { return forward_kinematics(x[0], x[1], x[2], parents); });
  };
  Rng rng(RngKey{26, 0});
  s.add("chain", fk_inputs(2, 3, rng), tree({-1, 0, 1}));
  s.add("fork", fk_inputs(1, 5, rng), tree({-1, 0, 0, 1, 1}));
  s.add("one joint", fk_inputs(2, 1, rng), tree({-1}));
  s.add("two roots", fk_inputs(2, 4, rng), tree({-1, 0, -1, 2}));
  s.add("no joint", fk_inputs(2, 0, rng), tree({})).zero_gradient = true;
  s.add("no frame", fk_inputs(0, 3, rng), tree({-1, 0, 1}));
  s.large("many frames", fk_inputs(50, 5, rng), tree({-1, 0, 1, 1, 3}));
  const auto broken = [&](const std::string& title, size_t which, const Shape& shape) {
    std::vector<Tensor> inputs = fk_inputs(2, 3, rng);
    inputs[which] = random(shape, 1);
    s.error(title, inputs, tree({-1, 0, 1}));
  };
  broken("no matrices", 0, {2, 3, 9});
  broken("matrices of another size", 0, {2, 3, 3, 4});
  broken("n differs in rest", 1, {1, 3, 3});
  broken("j differs in rest", 1, {2, 4, 3});
  broken("n differs in root", 2, {1, 3});
  broken("root of another width", 2, {2, 4});
  s.error("too few parents", fk_inputs(2, 3, rng), tree({-1, 0}));
  s.error("a parent after its child", fk_inputs(2, 3, rng), tree({-1, 2, 0}));
  std::vector<Tensor> mixed = fk_inputs(2, 1, rng);
  mixed[1] = mixed[1].cast(DType::f32);
  s.error("two dtypes", mixed, tree({-1}));
  s.random = [tree](Rng& r) {
    const int64_t j = random_size(r, 1, 6);
    std::vector<int> parents{-1};
    for (int64_t i = 1; i < j; ++i)
      parents.push_back(static_cast<int>(r.below(static_cast<uint64_t>(i))));
    return Sample{"", fk_inputs(random_size(r, 1, 3), j, r), tree(parents)};
  };
  return s;
}

std::vector<Tensor> lbs_inputs(int64_t n, int64_t v, int64_t j, Rng& rng) {
  return {random({n, v, 3}, rng), random({n, v, j}, rng), random({n, j, 3, 4}, rng),
          random({n, j, 3}, rng)};
}

OpSamples lbs_samples() {
  OpSamples s = samples_for<LinearBlendSkinning>();
  const Build build = [](Args x) { return linear_blend_skinning(x[0], x[1], x[2], x[3]); };
  Rng rng(RngKey{27, 0});
  s.add("two bodies", lbs_inputs(2, 4, 3, rng), build);
  s.add("one of everything", lbs_inputs(1, 1, 1, rng), build);
  s.add("no vertex", lbs_inputs(2, 0, 3, rng), build).zero_gradient = true;
  s.add("no joint", lbs_inputs(1, 2, 0, rng), build).zero_gradient = true;
  s.add("no body", lbs_inputs(0, 2, 3, rng), build);
  s.large("many vertices", lbs_inputs(4, 300, 5, rng), build);
  const auto broken = [&](const std::string& title, size_t which, const Shape& shape) {
    std::vector<Tensor> inputs = lbs_inputs(2, 4, 3, rng);
    inputs[which] = random(shape, 1);
    s.error(title, inputs, build);
  };
  broken("points of another width", 0, {2, 4, 2});
  broken("v differs", 1, {2, 5, 3});
  broken("j differs in W", 1, {2, 4, 2});
  broken("n differs in W", 1, {1, 4, 3});
  broken("transforms flattened", 2, {2, 3, 12});
  broken("n differs in T", 2, {1, 3, 3, 4});
  broken("j differs in rest", 3, {2, 2, 3});
  std::vector<Tensor> mixed = lbs_inputs(1, 1, 1, rng);
  mixed[1] = mixed[1].cast(DType::f32);
  s.error("two dtypes", mixed, build);
  s.random = [build](Rng& r) {
    return Sample{
        "", lbs_inputs(random_size(r, 1, 3), random_size(r, 1, 4), random_size(r, 1, 4), r), build};
  };
  return s;
}

OpSamples sixd_samples() {
  OpSamples s{"matrix_to_sixd", "R[..., 3, 3]"};
  const Build build = [](Args x) { return matrix_to_sixd(x[0]); };
  s.add("[2, 3, 3, 3]", {random({2, 3, 3, 3}, 1)}, build);
  s.add("one", {random({1, 3, 3}, 2)}, build);
  s.add("none", {random({0, 3, 3}, 3)}, build);
  s.large("many", {random({6000, 3, 3}, 4)}, build);
  s.error("no matrices", {random({2, 9}, 1)}, build);
  s.error("other matrices", {random({3, 3, 4}, 1)}, build);
  s.random = [build](Rng& r) {
    Shape shape = random_shape(r, 0, 3, 3);
    shape.push_back(3);
    shape.push_back(3);
    return Sample{"", {random(shape, r)}, build};
  };
  return s;
}

}  // namespace

void add_rotation(Table& t) {
  t.push_back(to_matrix_samples());
  t.push_back(fk_samples());
  t.push_back(lbs_samples());
  t.push_back(sixd_samples());
}

}  // namespace restage::gradcheck
