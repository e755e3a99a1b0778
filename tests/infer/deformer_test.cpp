// The fused deformation against the plain network and skinning op.
#include "infer/deformer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "autograd/base/rng.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/rotation.h"
#include "nn/weights/bundle.h"
#include "tests/support/emulated_gpu.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

Tensor random(const Shape& shape, const std::string& name, double size) {
  return Init{RngKey{11, 0}, DType::f32}.uniform(shape, size, name);
}

struct DeformerInput {
  Tensor points, weights, pose, bones;
};

/// Points on a bent sheet of about a body's size; weights that sum to one; any pose.
DeformerInput surface(int64_t v, int64_t joints = kJoints) {
  DeformerInput s;
  s.points = random({v, 3}, "points", 1);
  for (int64_t i = 0; i < v; ++i) {
    float* x = s.points.data<float>() + 3 * i;
    x[2] = 0.2f * std::sin(3 * x[0]) * x[1];
  }
  s.weights = random({v, joints}, "weights", 0.5);
  for (int64_t i = 0; i < v; ++i) {
    float* w = s.weights.data<float>() + joints * i;
    float sum = 0;
    for (int64_t j = 0; j < joints; ++j) sum += w[j] += 0.5f;
    for (int64_t j = 0; j < joints; ++j) w[j] /= sum;
  }
  s.pose = random({1, 3 * joints}, "pose", 1);
  s.bones = random({joints, 3, 4}, "bones", 1);
  return s;
}

/// The same from ops: every unit for every point.
Tensor reference(const DeformerInput& s, const Mlp3* offsets) {
  const int64_t v = s.points.size(0), j = s.weights.size(1);
  Context ctx;
  Var x = s.points.reshape({1, v, 3});
  if (offsets) x = x + (*offsets)(ctx, join_points(Var(s.pose), x));
  const Tensor no_rest = Tensor::zeros({1, j, 3});  // bones hold it
  return linear_blend_skinning(x, Var(s.weights.reshape({1, v, j})),
                               Var(s.bones.reshape({1, j, 3, 4})), Var(no_rest))
      .value.reshape({v, 3});
}

/// Largest difference, in units of the largest value.
double relative_gap(const Tensor& a, const Tensor& b) {
  EXPECT_EQ(a.shape(), b.shape());
  double most = 0, scale = 1e-30;
  for (int64_t i = 0; i < a.numel(); ++i) {
    most = std::max(most, std::fabs(a.item(i) - b.item(i)));
    scale = std::max(scale, std::fabs(b.item(i)));
  }
  return most / scale;
}

bool same_bits(const Tensor& a, const Tensor& b) {
  return a.to_vector<float>() == b.to_vector<float>();
}

std::unique_ptr<OffsetNet> net(int64_t width = MlpConfig().width) {
  return std::make_unique<OffsetNet>(MlpConfig{width, 0.2}, Init{RngKey{7, 0}, DType::f32});
}

void fill(Parameter& p, double value) { p.value = Tensor::full(p.value.shape(), value); }

/// Planes through the origin, in which the first units change sign, and points of which every tile
/// has some on both sides of each plane.
DeformerInput with_all_units_active(Mlp3* offsets) {
  fill(offsets->fc1.bias, 0);
  Tensor& w = offsets->fc1.weight.value;
  for (int64_t i = 0; i < w.size(0); ++i)
    for (int64_t c = 0; c < 69; ++c) w.data<float>()[69 * i + c] *= c < 66 ? 0.0f : 10.0f;
  DeformerInput s = surface(40);
  for (int64_t i = 0; i < 40; ++i)
    for (int64_t c = 0; c < 3; ++c)
      s.points.data<float>()[3 * i + c] =
          static_cast<float>((i % 2 == 0 ? 1 : -1) * (c == i / 2 % 3 ? 1 : 0.01 * c)) *
          (1 + 1e-6f * static_cast<float>(i));
  return s;
}

TEST(InferDeformer, EqualsThePlainNetworkForAnyNumberOfPoints) {
  const auto offsets = net();
  for (const int64_t v : {1, 2, 47, 48, 49, 63, 65, 384, 385, 500, 3000}) {
    const DeformerInput s = surface(v);
    const Deformer deformer(s.points, s.weights, offsets.get());
    EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(s, offsets.get())), 2e-6) << v;
  }
  const DeformerInput none = surface(0);
  EXPECT_EQ(Deformer(none.points, none.weights, offsets.get())(none.pose, none.bones).numel(), 0);
}

TEST(InferDeformer, EqualsThePlainNetworkForAnyWidth) {
  const DeformerInput s = surface(400);
  for (const int64_t width : {1, 5, 31, 33, 300}) {
    const auto offsets = net(width);
    const Deformer deformer(s.points, s.weights, offsets.get());
    EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(s, offsets.get())), 2e-6) << width;
  }
}

TEST(InferDeformer, EqualsTheTrainedNetwork) {
  const Bundle models =
      load_bundle(std::string(RESTAGE_SOURCE_DIR) + "/experiments/weights/lite.safetensors");
  const DeformerInput s = surface(5000);
  const Deformer deformer(s.points, s.weights, models.find_as<OffsetNet>("deformation.offsets"));
  const Tensor expected = reference(s, models.find_as<OffsetNet>("deformation.offsets"));
  EXPECT_LT(relative_gap(deformer(s.pose, s.bones), expected), 2e-6);
  EXPECT_LT(relative_gap(deformer(s.pose, s.bones, true), expected), 2e-6);
  EXPECT_GT(deformer.active_share(s.pose), 0.005);
  EXPECT_LT(deformer.active_share(s.pose), 0.3);
}

TEST(InferDeformer, EqualsThePlainNetworkWhenAllOrNoUnitsChangeSign) {
  const DeformerInput s = surface(1000);
  const auto offsets = net();
  const auto share = [&] {
    const Deformer deformer(s.points, s.weights, offsets.get());
    EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(s, offsets.get())), 5e-6);
    return deformer.active_share(s.pose);
  };
  fill(offsets->fc1.bias, 50);  // all on
  EXPECT_EQ(share(), 0);
  fill(offsets->fc1.bias, -50);  // all off
  EXPECT_EQ(share(), 0);
  const DeformerInput around = with_all_units_active(offsets.get());
  const Deformer deformer(around.points, around.weights, offsets.get());
  EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(around, offsets.get())), 5e-6);
  EXPECT_EQ(deformer.active_share(s.pose), 1);
}

TEST(InferDeformer, PointsInOnePlace) {
  DeformerInput s = surface(700);
  for (int64_t i = 0; i < s.points.numel(); ++i) s.points.data<float>()[i] = 0.25f;
  const auto offsets = net();
  const Deformer deformer(s.points, s.weights, offsets.get());
  EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(s, offsets.get())), 2e-6);
  EXPECT_EQ(deformer.active_share(s.pose), 0);
}

TEST(InferDeformer, SkinsAloneWithoutOffsets) {
  for (const int64_t joints : {1, 22, 30}) {
    const DeformerInput s = surface(333, joints);
    const Deformer deformer(s.points, s.weights, nullptr);
    EXPECT_LT(relative_gap(deformer(s.pose, s.bones), reference(s, nullptr)), 1e-6);
    EXPECT_EQ(deformer.active_share(s.pose), 0);
  }
}

TEST(InferDeformer, AGpuGivesTheSame) {
  const DeformerInput s = surface(500);
  for (const int64_t width : {0, 5, 300}) {
    const auto offsets = width > 0 ? net(width) : nullptr;
    const Deformer here(s.points, s.weights, offsets.get()),
        there(s.points, s.weights, offsets.get(), emulated_gpu());
    EXPECT_LT(relative_gap(there(s.pose, s.bones), here(s.pose, s.bones)), 2e-6) << width;
    EXPECT_EQ(there.active_share(s.pose), here.active_share(s.pose)) << width;
  }
  const Deformer none(surface(0).points, surface(0).weights, net().get(), emulated_gpu());
  EXPECT_EQ(none(s.pose, s.bones).numel(), 0);
}

TEST(InferDeformer, BitsDoNotDependOnThreads) {
  const DeformerInput s = surface(4000);
  const auto offsets = net();
  const Deformer deformer(s.points, s.weights, offsets.get());
  const auto with = [&](int n) {
    const testing::UseThreads use(n);
    return deformer(s.pose, s.bones);
  };
  for (const int n : {2, 3, 7}) EXPECT_TRUE(same_bits(with(n), with(1))) << n;
}

TEST(InferDeformer, BitsAreTheSameOnAllVectorSets) {
  const auto sets = testing::vector_sets();
  if (sets.size() < 2) GTEST_SKIP() << "this processor has fewer than two vector sets";
  const Bundle models =
      load_bundle(std::string(RESTAGE_SOURCE_DIR) + "/experiments/weights/lite.safetensors");
  const auto some = net(), odd = net(33), all = net();
  const DeformerInput any = surface(1000), everywhere = with_all_units_active(all.get());
  const auto expect_same = [&](const DeformerInput& s, const Mlp3* offsets, double least_share) {
    for (const bool dense : {false, true}) {
      const auto with = [&](const std::string& set) {
        const testing::UseSet use(set);
        const Deformer deformer(s.points, s.weights, offsets);
        EXPECT_GE(deformer.active_share(s.pose), least_share);
        return deformer(s.pose, s.bones, dense);
      };
      const Tensor first = with(sets[0]);
      for (size_t i = 1; i < sets.size(); ++i) EXPECT_TRUE(same_bits(with(sets[i]), first));
    }
  };
  expect_same(any, models.find_as<OffsetNet>("deformation.offsets"), 0.005);
  expect_same(any, some.get(), 0.005);
  expect_same(any, odd.get(), 0.005);
  expect_same(everywhere, all.get(), 1);  // every unit of every tile
  expect_same(any, nullptr, 0);
}

TEST(InferDeformer, NaNDoesNotVanish) {
  DeformerInput s = surface(200);
  s.pose.data<float>()[5] = std::nanf("");
  const auto offsets = net();
  const Tensor out = Deformer(s.points, s.weights, offsets.get())(s.pose, s.bones);
  for (int64_t i = 0; i < out.numel(); ++i) EXPECT_TRUE(std::isnan(out.item(i)));
}

TEST(InferDeformer, RefusesWhatDoesNotFit) {
  const DeformerInput s = surface(10);
  const auto offsets = net();
  const WeightNet skinning(MlpConfig(), Init{RngKey{7, 0}, DType::f32});
  EXPECT_THROW(Deformer(s.points, s.weights, &skinning.net), ShapeError);
  EXPECT_THROW(Deformer(s.points, s.weights.rows(0, 9), offsets.get()), ShapeError);
  EXPECT_THROW(Deformer(s.weights, s.weights, offsets.get()), ShapeError);
  EXPECT_THROW(Deformer(s.points.cast(DType::f64), s.weights, offsets.get()), ShapeError);
  const OffsetNet wide(MlpConfig(), Init{RngKey{7, 0}, DType::f64});
  EXPECT_THROW(Deformer(s.points, s.weights, &wide), ShapeError);
  const Deformer deformer(s.points, s.weights, offsets.get());
  EXPECT_THROW(deformer(random({1, 65}, "p", 1), s.bones), ShapeError);
  EXPECT_THROW(deformer(s.pose, random({21, 3, 4}, "b", 1)), ShapeError);
}

}  // namespace
}  // namespace restage
