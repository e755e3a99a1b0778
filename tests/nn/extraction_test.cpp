#include "nn/models/extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "autograd/gradcheck/evaluate.h"
#include "nn/models/registry.h"
#include "tests/support/files.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_body;

std::shared_ptr<SkeletonModel> small(const std::string& name) {
  std::vector<std::string> sizes = {"points=96"};
  if (name != "skeleton/pointnet") {
    sizes.insert(sizes.end(), {"width=32", "layers=1", "neighbours=8"});
    if (name == "skeleton/patch_transformer") sizes.push_back("centres=24");
  }
  return make_model_as<SkeletonModel>(name, model_config(name, sizes),
                                      Init{RngKey{1, 0}, DType::f32});
}

Points cloud(size_t n, uint64_t seed = 1) {
  return surface_points(tiny_body("b", "test").rest, n, RngKey{seed, 0});
}

void shuffle(Points& points, uint64_t seed) {
  Rng rng(RngKey{seed, 5});
  for (size_t i = points.size(); i > 1; --i) std::swap(points[i - 1], points[rng.below(i)]);
}

TEST(InferExtraction, RepeatsOfPointsDoNotMatterToTheLastBit) {
  const auto model = small("skeleton/point_transformer");
  for (const size_t n : {70u, 400u}) {
    Points points = cloud(n);
    const Joints once = extract_joints(*model, points, "c", RngKey{3, 0}, {.samples = 2});
    points.insert(points.begin(), 1000, points[7]);  // pixels without depth
    EXPECT_EQ(extract_joints(*model, points, "c", RngKey{3, 0}, {.samples = 2}), once) << n;
  }
}

TEST(InferExtraction, PointsFarFromThePersonAreLeftOut) {
  const auto model = small("skeleton/patch_transformer");
  const Points points = cloud(400);
  const Joints alone = extract_joints(*model, points, "c", RngKey{3, 0}, {.samples = 2});
  Points some = points;
  some.insert(some.begin() + 5, {{4000, 0, 0}, {0, -7, 0}, {1e30f, 1e30f, 0}});
  EXPECT_EQ(extract_joints(*model, some, "c", RngKey{3, 0}, {.samples = 2}), alone);
  Points few = cloud(80);
  const Joints of_few = extract_joints(*model, few, "c", RngKey{3, 0}, {.samples = 2});
  few.push_back({50, 0, 0});
  EXPECT_EQ(extract_joints(*model, few, "c", RngKey{3, 0}, {.samples = 2}), of_few);
  for (int k = 0; k < 60; ++k) some.push_back({0, 0.01f * static_cast<float>(k), 6});
  EXPECT_EQ(extract_joints(*model, some, "c", RngKey{3, 0}, {.samples = 2}), alone)
      << "one in seven";
  for (int k = 0; k < 60; ++k) some.push_back({0.01f * static_cast<float>(k), 0, 6});
  // Over a fifth: no mistakes of a sensor, and half a room.
  EXPECT_NE(extract_joints(*model, some, "c", RngKey{3, 0}, {.samples = 2}), alone);
}

TEST(InferExtraction, OrderOfPointsDoesNotMatterToTheLastBit) {
  for (const std::string name :
       {"skeleton/point_transformer", "skeleton/pointnet", "skeleton/patch_transformer"}) {
    const auto model = small(name);
    for (const size_t n : {64u, 96u, 400u}) {  // repeated, all, chosen
      Points points = cloud(n);
      const Joints first = extract_joints(*model, points, "c", RngKey{3, 0}, {.samples = 2});
      for (uint64_t seed = 0; seed < 3; ++seed) {
        shuffle(points, seed);
        EXPECT_EQ(extract_joints(*model, points, "c", RngKey{3, 0}, {.samples = 2}), first)
            << name << " " << n;
      }
      EXPECT_NE(extract_joints(*model, cloud(n, 2), "c", RngKey{3, 0}, {.samples = 2}), first)
          << name << " " << n;
      if (n == 96) continue;  // all of them, once: nothing to choose
      EXPECT_NE(extract_joints(*model, points, "c", RngKey{4, 0}, {.samples = 2}), first)
          << name << " " << n;
    }
  }
}

TEST(InferExtraction, JointsMoveWithTheCloud) {
  const auto model = small("skeleton/patch_transformer");
  Points points = cloud(300);
  const Joints here = extract_joints(*model, points, "c", RngKey{});
  const Point far(4.0f, -2.0f, 8.0f);
  for (Point& p : points) p += far;
  const Joints there = extract_joints(*model, points, "c", RngKey{});
  for (size_t j = 0; j < kJoints; ++j)
    EXPECT_LT((there[j] - here[j] - far.cast<double>()).norm(), 1e-4);
}

TEST(InferExtraction, ViewsTogetherSeeTheWholeCloud) {
  struct Centre final : SkeletonModel {  // of its view's points
    SkeletonOutput forward(Context&, const SkeletonInput& in) override {
      SkeletonOutput out;
      out.joints = Var(Tensor::zeros({in.cloud.size(0), kJoints, 3}));
      return out;
    }
    int64_t points() const override { return 64; }
    void visit(Fields&) override {}
    const char* kind() const override { return "Centre"; }
  } model;
  const Points points = [] {
    Points out;  // no two in a cell
    Rng rng(RngKey{3, 0});
    for (int i = 0; i < 256; ++i)
      out.emplace_back(0.05f * static_cast<float>(i % 16), 0.05f * static_cast<float>(i / 16),
                       static_cast<float>(rng.uniform()));
    return out;
  }();
  Vec3 mean = Vec3::Zero();
  for (const Point& p : points) mean += p.cast<double>() / 256;
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const Joints joints = extract_joints(model, points, "c", RngKey{seed, 0}, {.samples = 4});
    EXPECT_LT((joints[0] - mean).norm(), 1e-6) << "every point is in one of the four views";
  }
}

/// Every joint at the cloud's highest point. The first `wrong` views are answered wrongly.
struct HighestPoint final : SkeletonModel {
  SkeletonOutput forward(Context&, const SkeletonInput& in) override {
    const int64_t n = in.cloud.size(0);
    Tensor out = Tensor::zeros({n, kJoints, 3});
    for (int64_t s = 0; s < n; ++s) {
      const float* x = in.cloud.value.data<float>() + s * 64 * 3;
      const float* top = x;
      for (int64_t i = 0; i < 64; ++i)
        if (x[3 * i + 1] > top[1]) top = x + 3 * i;
      for (int64_t j = 0; j < kJoints; ++j)
        for (int64_t c = 0; c < 3; ++c)
          out.data<float>()[(s * kJoints + j) * 3 + c] = top[c] + (s < wrong ? 5.0f : 0.0f);
    }
    SkeletonOutput answer;
    answer.joints = Var(out);
    return answer;
  }
  int64_t points() const override { return 64; }
  void visit(Fields&) override {}
  const char* kind() const override { return "test"; }
  int64_t wrong = 0;
};

TEST(InferExtraction, ViewsAreTurnedBackAndWrongOnesOutvoted) {
  HighestPoint model;
  const Points points = cloud(64);
  const Point top = *std::max_element(points.begin(), points.end(),
                                      [](const auto& a, const auto& b) { return a.y() < b.y(); });
  for (const int views : {1, 2, 3, 4, 8, 16}) {
    for (model.wrong = 0; model.wrong <= (views < 8 ? 0 : views / 4); ++model.wrong) {
      const Joints joints = extract_joints(model, points, "c", RngKey{9, 0}, {.samples = views});
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_LT((joints[j] - top.cast<double>()).norm(), 1e-5) << views << " " << model.wrong;
    }
  }
}

TEST(InferExtraction, ViewsAgreeOnRotations) {
  // A vector of the cloud as the second column, and a cross product with it as the first: what a
  // mirror does to a rotation, it does to these.
  struct Pointing final : SkeletonModel {
    SkeletonOutput forward(Context&, const SkeletonInput& in) override {
      const int64_t n = in.cloud.size(0);
      SkeletonOutput out;
      Tensor turns = Tensor::zeros({n, kJoints, 6});
      for (int64_t i = 0; i < n; ++i) {
        const Point* p = reinterpret_cast<const Point*>(in.cloud.value.data<float>() + i * 64 * 3);
        const Point far = *std::max_element(
            p, p + 64, [](const Point& a, const Point& b) { return a.norm() < b.norm(); });
        const Point across = far.cross(Point(0, 1, 0));
        for (int64_t j = 0; j < kJoints; ++j)
          for (int64_t c = 0; c < 3; ++c) {
            turns.data<float>()[6 * (i * kJoints + j) + c] = across[c];
            turns.data<float>()[6 * (i * kJoints + j) + 3 + c] = far[c];
          }
      }
      out.joints = Var(Tensor::zeros({n, kJoints, 3}));
      out.turns = Var(turns);
      out.uncertainty = Var(Tensor::full({n, kJoints}, -3));
      return out;
    }
    int64_t points() const override { return 64; }
    void visit(Fields&) override {}
    const char* kind() const override { return "Pointing"; }
  } model;
  const Points points = cloud(64);
  const SeenJoints one = JointExtractor(model)(points, "c", RngKey{9, 0}),
                   eight = JointExtractor(model, {.samples = 8})(points, "c", RngKey{9, 0});
  for (size_t j = 0; j < kJoints; ++j) {
    EXPECT_LT(((*one.turns)[j] - (*eight.turns)[j]).norm(), 1e-5);
    EXPECT_NEAR((*one.turns)[j].determinant(), 1, 1e-9);
    EXPECT_NEAR((*eight.uncertainty)[j], std::exp(-3.0), 1e-6);
  }
}

/// Knows adults: whoever it sees has their joints, in the cloud's height. In clouds of another size
/// the joints are wrong, and too far apart.
struct KnowsAdults final : SkeletonModel {
  static constexpr float kHeight = 1.6f;  // of the cloud
  KnowsAdults() {
    joints = tiny_body("b", "test").joints;
    double tall = leg_length(joints);
    for (size_t j = kHead; j != 0; j = static_cast<size_t>(kParents[j]))
      tall += (joints[j] - joints[static_cast<size_t>(kParents[j])]).norm();
    for (Vec3& joint : joints) joint *= 1.5 / tall;
  }
  SkeletonOutput forward(Context&, const SkeletonInput& in) override {
    ++looks;
    const int64_t n = in.cloud.size(0);
    Tensor out = Tensor::zeros({n, kJoints, 3});
    for (int64_t i = 0; i < n; ++i) {
      const float* x = in.cloud.value.data<float>() + i * 64 * 3;
      float low = x[1], high = x[1];
      for (int64_t k = 0; k < 64; ++k)
        low = std::min(low, x[3 * k + 1]), high = std::max(high, x[3 * k + 1]);
      const float size = (high - low) / kHeight;
      const float wrong = size < 0.8f || size > 1.25f ? 1.08f : 1.0f;
      for (int64_t j = 0; j < kJoints; ++j)
        for (int c = 0; c < 3; ++c)
          out.data<float>()[3 * (i * kJoints + j) + c] =
              wrong * size * static_cast<float>(joints[static_cast<size_t>(j)][c]);
    }
    SkeletonOutput answer;
    answer.joints = Var(out);
    answer.uncertainty = Var(Tensor::full({n, kJoints}, -3));
    return answer;
  }
  int64_t points() const override { return 64; }
  void visit(Fields&) override {}
  const char* kind() const override { return "KnowsAdults"; }
  Joints joints;
  int looks = 0;
};

TEST(InferExtraction, PeopleOfAnySizeAreShownAsAdults) {
  KnowsAdults model;
  Points adult = cloud(64);
  float low = 0, high = 0;
  for (const Point& p : adult) low = std::min(low, p.y()), high = std::max(high, p.y());
  for (Point& p : adult) p *= KnowsAdults::kHeight / (high - low);
  const RngKey key{9, 0};
  const SeenJoints usual = JointExtractor(model)(adult, "c", key);
  for (const double size : {0.4, 0.5, 0.7, 1.0, 1.5, 2.0}) {
    Points points = adult;
    for (Point& p : points) p *= static_cast<float>(size);
    JointExtractor any(model, {.any_size = true});
    model.looks = 0;
    const SeenJoints first = any(points, "c", key);
    if (size == 1) {
      EXPECT_EQ(model.looks, 1);
    }
    model.looks = 0;
    const SeenJoints next = any(points, "c", key, &first);
    EXPECT_EQ(model.looks, 1) << "the frame before says how tall somebody is";
    for (const SeenJoints* seen : {&first, &next})
      for (size_t j = 0; j < kJoints; ++j) {
        EXPECT_LT((seen->joints[j] - size * usual.joints[j]).norm(), 0.015 * size)
            << size << " " << j;
        EXPECT_NEAR((*seen->uncertainty)[j], size * std::exp(-3.0), 0.3 * size * std::exp(-3.0));
      }
    if (size != 1) {
      EXPECT_GT((JointExtractor(model)(points, "c", key).joints[kHead] - size * usual.joints[kHead])
                    .norm(),
                0.01 * size);
    }
  }
}

TEST(InferExtraction, MirroredViewsChangeSides) {
  // Whatever the view shows, left is where x is positive in it.
  struct Sides final : SkeletonModel {
    SkeletonOutput forward(Context&, const SkeletonInput& in) override {
      Tensor out = Tensor::zeros({in.cloud.size(0), kJoints, 3});
      for (int64_t i = 0; i < out.numel() / 3; ++i)
        out.data<float>()[3 * i] =
            static_cast<float>(tiny_body("b", "test").joints[i % kJoints].x());
      SkeletonOutput answer;
      answer.joints = Var(out);
      return answer;
    }
    int64_t points() const override { return 64; }
    void visit(Fields&) override {}
    const char* kind() const override { return "test"; }
  } model;
  const Points points = cloud(64);
  const Joints one = extract_joints(model, points, "c", RngKey{9, 0}, {.samples = 1}),
               two = extract_joints(model, points, "c", RngKey{9, 0}, {.samples = 2});
  EXPECT_GT(one[20].x(), one[21].x());
  for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((one[j] - two[j]).norm(), 1e-5);
}

TEST(InferExtraction, EveryViewRemembersTheFrameBefore) {
  // Answers what it remembers, and as uncertainty the trust in it.
  struct Remembering final : SkeletonModel {
    SkeletonOutput forward(Context&, const SkeletonInput& in) override {
      Tensor joints = Tensor::zeros({in.cloud.size(0), kJoints, 3});
      Tensor trust = Tensor::zeros({in.cloud.size(0), kJoints});
      for (int64_t k = 0; in.past.defined() && k < trust.numel(); ++k) {
        std::copy_n(in.past.data<float>() + 4 * k, 3, joints.data<float>() + 3 * k);
        trust.data<float>()[k] = in.past.data<float>()[4 * k + 3];
      }
      SkeletonOutput out;
      out.joints = Var(joints);
      out.uncertainty = Var(trust);
      return out;
    }
    int64_t points() const override { return 64; }
    void visit(Fields&) override {}
    const char* kind() const override { return "Remembering"; }
  } model;
  const Points points = cloud(64);
  SeenJoints before(tiny_body("b", "test").joints);
  before.joints[20] += Vec3(0.1, 0.2, 0.3);  // not the mirror image of the other wrist
  before.uncertainty.emplace();
  for (size_t j = 0; j < kJoints; ++j)
    (*before.uncertainty)[j] = 0.001 * static_cast<double>(1 + j);
  for (const int views : {1, 2, 4, 8}) {
    JointExtractor extractor(model, {.samples = views});
    const SeenJoints seen = extractor(points, "c", RngKey{9, 0}, &before);
    for (size_t j = 0; j < kJoints; ++j) {
      EXPECT_LT((seen.joints[j] - before.joints[j]).norm(), 1e-5) << views;
      EXPECT_NEAR(std::log((*seen.uncertainty)[j]), trust_of((*before.uncertainty)[j]), 1e-6);
    }
    SeenJoints elsewhere = before;
    for (Vec3& joint : elsewhere.joints) joint.x() += 1.5;
    EXPECT_EQ(extractor(points, "c", RngKey{9, 0}, &elsewhere).joints,
              extractor(points, "c", RngKey{9, 0}).joints);
  }
}

TEST(InferExtraction, WhatNobodyTrustsIsNotRemembered) {
  const auto model = make_model_as<SkeletonModel>(
      "skeleton/patch_transformer",
      model_config("skeleton/patch_transformer", {"points=64", "width=32", "layers=1",
                                                  "neighbours=8", "centres=24", "memory=true"}),
      Init{RngKey{1, 0}, DType::f32});
  const Tensor points = Tensor::full({1, 64, 3}, 0.5);
  const auto answer = [&](float trust) {
    Tensor past = Tensor::full({1, kJoints, 4}, 0.3);
    for (int64_t j = 0; j < kJoints; ++j) past.data<float>()[4 * j + 3] = trust;
    Context ctx;
    return model->forward(ctx, {points, past}).joints.value;
  };
  Context ctx;
  const Tensor nothing = model->forward(ctx, points).joints.value;
  EXPECT_TRUE(gradcheck::same_bits(answer(0), nothing));
  EXPECT_FALSE(gradcheck::same_bits(answer(1), nothing));
}

TEST(InferExtraction, TooFewDistinctPoints) {
  const auto model = small("skeleton/patch_transformer");
  for (const size_t n : {0u, 1u, 3u, 63u}) {
    test::expect_refused([&] { extract_joints(*model, cloud(n), "scan.ply", RngKey{}); },
                         "scan.ply: ", std::to_string(n) + " distinct");
  }
  Points repeated;
  for (int i = 0; i < 50; ++i)
    for (const Point& p : cloud(63)) repeated.push_back(p);
  EXPECT_HAS(test::refusal_of([&] { extract_joints(*model, repeated, "scan.ply", RngKey{}); }),
             "63 distinct");
  EXPECT_EQ(test::refusal_of([&] { extract_joints(*model, cloud(64), "scan.ply", RngKey{}); }), "");
}

TEST(InferExtraction, ValuesThatAreNotFinite) {
  const auto model = small("skeleton/patch_transformer");
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()}) {
    Points points = cloud(200);
    points[77].y() = bad;
    test::expect_refused([&] { extract_joints(*model, points, "scan.ply", RngKey{}); },
                         "scan.ply: ", "not finite");
  }
  Points huge = cloud(200);
  for (Point& p : huge) p *= 1e38f;
  EXPECT_NE(test::refusal_of([&] { extract_joints(*model, huge, "scan.ply", RngKey{}); }), "");
}

TEST(InferExtraction, SurfacePointsFollowTheArea) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {8, 0, 0}, {5, 1, 0}};
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  const Points points = surface_points(mesh, 4000, RngKey{});
  ASSERT_EQ(points.size(), 4000u);
  const auto left =
      std::count_if(points.begin(), points.end(), [](const Point& p) { return p.x() < 2; });
  EXPECT_NEAR(static_cast<double>(left) / 4000, 0.25, 0.03);
  for (const Point& p : points) {
    const Point q = p.x() < 2 ? p : Point((p.x() - 5) / 3, p.y(), p.z());
    EXPECT_GE(q.minCoeff(), -1e-5f);
    EXPECT_LE(q.x() + q.y(), 1.0f + 1e-5f);
    EXPECT_EQ(q.z(), 0.0f);
  }
  EXPECT_EQ(surface_points(mesh, 50, RngKey{7, 0}), surface_points(mesh, 50, RngKey{7, 0}));
}

TEST(InferExtraction, CloudsAndFlatMeshesGiveTheirVertices) {
  Mesh mesh;
  mesh.vertices = cloud(100);
  EXPECT_EQ(surface_points(mesh, 50, RngKey{}), mesh.vertices);
  mesh.faces = {{4, 4, 4}};
  EXPECT_EQ(surface_points(mesh, 50, RngKey{}), mesh.vertices);
}

}  // namespace
}  // namespace restage
