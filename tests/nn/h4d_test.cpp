// H4D's body and the buffers that a weights file keeps beside the networks.
#include "nn/models/h4d.h"

#include <gtest/gtest.h>

#include "autograd/gradcheck/evaluate.h"
#include "nn/models/registry.h"
#include "nn/weights/bundle.h"
#include "tests/support/errors.h"
#include "tests/support/expect_near.h"

namespace restage {
namespace {

using gradcheck::random;

/// Five vertices, three joints in a row, two numbers of shape.
LinearBody three_joints() {
  const Tensor weights =
      Tensor::from<double>({5, 3}, {1, 0, 0, 0.5, 0.5, 0, 0, 1, 0, 0, 0.25, 0.75, 0.2, 0.3, 0.5});
  return {random({5, 3}, 1), random({5, 3, 2}, 2), random({3, 3}, 3), random({3, 3, 2}, 4), weights,
          {-1, 0, 1}};
}

MotionBasis small_basis() {
  return {random({2, 6}, 5), random({6}, 6), random({3, 12}, 7), random({12}, 8)};
}

TEST(LinearBodyPoses, AtRestTheBodyKeepsItsShape) {
  const LinearBody body = three_joints();
  const Var shape(random({2, 2}, 9));
  const Tensor posed = pose_body(body, shape, Var(Tensor::zeros({2, 1, 9}, DType::f64))).value;
  const Tensor rest = shaped(body.mean, body.directions, shape).value;
  expect_near(posed.reshape({2, 5, 3}), rest, 1e-12, "rest");
}

/// Gradients of u * f(inputs) beside central differences.
void expect_gradients(const std::vector<Tensor>& inputs, const gradcheck::Build& build) {
  const gradcheck::Sample sample{"", inputs, build};
  const Tensor u = random(gradcheck::value_of(sample, inputs).shape(), 20);
  const auto value = [&](const std::vector<Tensor>& at) {
    const Tensor y = gradcheck::value_of(sample, at);
    double sum = 0;
    for (int64_t i = 0; i < y.numel(); ++i) sum += u.item(i) * y.item(i);
    return sum;
  };
  const gradcheck::Evaluation found = gradcheck::evaluate(sample, u);
  for (size_t k = 0; k < inputs.size(); ++k)
    for (int64_t i = 0; i < inputs[k].numel(); ++i) {
      double sides[2];
      for (const int side : {0, 1}) {
        std::vector<Tensor> at = inputs;
        at[k] = inputs[k].clone();
        at[k].data<double>()[i] += side == 0 ? -1e-6 : 1e-6;
        sides[side] = value(at);
      }
      EXPECT_NEAR(found.gradients[k].item(i), (sides[1] - sides[0]) / 2e-6, 1e-6) << k << " " << i;
    }
}

TEST(LinearBodyPoses, HaveTheGradientsOfFiniteDifferences) {
  expect_gradients({random({2, 2}, 10), random({2, 3, 9}, 11)},
                   [](gradcheck::Args x) { return pose_body(three_joints(), x[0], x[1]); });
  expect_gradients({random({2, 9}, 12), random({2, 5}, 13)},
                   [](gradcheck::Args x) { return h4d_poses(x[0], x[1], small_basis()); });
}

H4dConfig two_stages() {
  return {.shape = 2,
          .pose = 9,
          .motion = 5,
          .root = 2,
          .frames = 3,
          .hidden = 4,
          .features = 3,
          .recurrent = 4,
          .aux = 2};
}

TEST(H4dSecondStage, HasTheProgramsNumberOfParameters) {
  const auto parameters = [](int64_t aux) {
    H4d net({.aux = aux}, Init{RngKey{1, 0}});
    return count_parameters(net);
  };
  EXPECT_EQ(parameters(0), 3558828);
  EXPECT_EQ(parameters(128) - parameters(0), 2627712 + 2847816);
}

TEST(H4dSecondStage, BeginsAsTheFirstAndCorrectsEveryFrame) {
  H4d net(two_stages(), Init{RngKey{1, 0}, DType::f64});
  Context ctx;
  const H4d::Codes codes = net.codes(ctx, Var(random({2, 3, 7, 3}, 14)));
  const Tensor plain = h4d_poses(codes.pose, codes.motion, small_basis()).value;
  expect_near(net.poses(ctx, codes, small_basis()).value, plain, 0, "at the start");
  net.aux_decoder->linear.bias.value = random({9}, 15);
  const Tensor moved = net.poses(ctx, codes, small_basis()).value;
  for (int64_t i = 0; i < moved.numel(); ++i)
    EXPECT_NEAR(moved.item(i) - plain.item(i), net.aux_decoder->linear.bias.value.item(i % 9),
                1e-12);
}

TEST(H4dSecondStage, HasTheGradientsOfFiniteDifferences) {
  H4d net(two_stages(), Init{RngKey{1, 0}, DType::f64});
  net.aux_decoder->linear.weight.value = random({9, 4}, 16);
  expect_gradients({random({2, 9}, 17), random({2, 5}, 18), random({2, 2}, 19)},
                   [&](gradcheck::Args x) {
                     Context ctx;
                     return net.poses(ctx, {{}, x[0], x[1], x[2]}, small_basis());
                   });
}

AnyConfig with_body() {
  return model_config(
      "codes/h4d", {"shape=2", "pose=9", "motion=5", "root=2", "frames=3", "hidden=4", "features=3",
                    "recurrent=4", "vertices=5", "faces=2", "aux=2"});
}

Bundle made_with(const LinearBody& body) {
  const AnyConfig sizes = with_body();
  auto net = std::make_shared<H4d>(sizes.as<H4dConfig>(), Init{RngKey{1, 0}});
  net->space.set(body, {{0, 1, 2}, {2, 3, 4}}, small_basis());
  Bundle out;
  out.put("codes", {"codes/h4d", sizes, net, {}});
  return out;
}

TEST(H4dSpaces, GoThroughAFile) {
  const TensorFile file = to_file(made_with(three_joints()));
  const Bundle back = bundle_of(file, "the file");
  const H4d& net = back.need_as<H4d>("codes", "the file");
  const LinearBody body = net.space.body();
  expect_near(body.mean, three_joints().mean.cast(DType::f32), 1e-6, "mean");
  expect_near(body.joint_directions, three_joints().joint_directions.cast(DType::f32), 1e-6,
              "joints");
  EXPECT_EQ(body.parents, (std::vector<int>{-1, 0, 1}));
  EXPECT_EQ(net.space.faces(), (std::vector<std::array<int32_t, 3>>{{0, 1, 2}, {2, 3, 4}}));
  expect_near(net.space.basis().joints, small_basis().joints.cast(DType::f32), 1e-6, "basis");
  EXPECT_EQ(safetensors_bytes(to_file(back)), safetensors_bytes(file));
}

TEST(H4dSpaces, WhatDoesNotFitIsRefused) {
  LinearBody loop = three_joints();
  loop.parents = {-1, 2, 1};
  const Bundle bundle = made_with(loop);
  EXPECT_HAS(test::refusal_of([&] { bundle.need_as<H4d>("codes", "").space.body(); }),
             "hang together");
  const AnyConfig sizes = with_body();
  H4d net(sizes.as<H4dConfig>(), Init{RngKey{1, 0}});
  net.space.set(three_joints(), {{0, 1, 2}, {2, 3, 5}}, small_basis());
  EXPECT_HAS(test::refusal_of([&] { net.space.faces(); }), "without its vertex");
  EXPECT_THROW(net.space.set(three_joints(), {}, small_basis()), ShapeError);
  H4dConfig bad = sizes.as<H4dConfig>();
  bad.root = 5;
  EXPECT_HAS(test::refusal_of([&] { H4d(bad, Init{RngKey{1, 0}}); }), "do not fit");
}

}  // namespace
}  // namespace restage
