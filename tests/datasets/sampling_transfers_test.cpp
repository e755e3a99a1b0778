// Pairs of bodies in one pose, and meshes of fewer vertices.
#include "datasets/sampling/transfers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/datasets/sampling_support.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using testing::training_corpus;

TransferConfig small() {
  TransferConfig c;
  c.frames = 2;
  c.points = 50;
  c.vertices = 80;
  return c;
}

TEST(ThinMesh, KeepsSpreadVerticesAndJoinsThem) {
  const Mesh& mesh = training_corpus().bodies[0].rest;
  const ThinMesh thin = thin_mesh(mesh, 80);
  ASSERT_EQ(thin.kept.size(), 80u);
  EXPECT_TRUE(std::is_sorted(thin.kept.begin(), thin.kept.end()));
  std::set<int32_t> used;
  for (const Triangle& f : thin.faces)
    for (const int32_t i : f) {
      ASSERT_LT(i, 80);
      used.insert(i);
    }
  EXPECT_GT(used.size(), 60u);  // hardly any is left alone
  EXPECT_EQ(thin_mesh(mesh, 0).faces, mesh.faces);
  EXPECT_EQ(thin_mesh(mesh, mesh.vertices.size()).faces, mesh.faces);
}

TEST(TransferSampler, SamplesAreFunctionsOfTheirNumber) {
  const TransferSampler sampler(training_corpus(), small(), 7);
  const TransferBatch all = sampler.batch(3, 4), one = sampler.batch(5, 1);
  EXPECT_EQ(all.pose.shape(), (Shape{4, 2, 50, 3}));
  EXPECT_EQ(all.truth.shape(), (Shape{4, 2, 80, 3}));
  EXPECT_TRUE(testing::same_bits(all.pose.rows(2, 3), one.pose));
  EXPECT_TRUE(testing::same_bits(all.truth.rows(2, 3), one.truth));
  EXPECT_TRUE(testing::same_bits(all.identity.rows(2, 3), one.identity));
  EXPECT_TRUE(testing::same_bits(all.faces.rows(2, 3), one.faces));
}

/// One person who stands in T-pose all the time.
Corpus standing() {
  Corpus out;
  out.bodies = {training_corpus().bodies[0]};
  Motion still = training_corpus().motions[0];
  still.rest = out.bodies[0].joints;
  for (auto& frame : still.global) frame.fill(Eigen::Quaternionf::Identity());
  out.motions = {still};
  return out;
}

TEST(TransferSampler, TruthHasTheIdentitysOrder) {
  const Corpus corpus = standing();
  TransferConfig c = small();
  c.heading = 0;
  const TransferBatch b = TransferSampler(corpus, c, 1).batch(0, 1);
  for (int64_t v = 0; v < 80; ++v)
    EXPECT_LT((testing::at(b.truth, 0, v) - testing::at(b.identity, 0, v)).norm(), 1e-5);
  c.shuffle = false;
  c.points = 0;
  const TransferBatch kept = TransferSampler(corpus, c, 1).batch(0, 1);
  double moved = 0;
  for (int64_t v = 0; v < 80; ++v) {
    EXPECT_LT((testing::at(kept.pose, 0, v) - testing::at(kept.identity, 0, v)).norm(), 1e-5);
    moved =
        std::max(moved, (testing::at(b.identity, 0, v) - testing::at(kept.identity, 0, v)).norm());
  }
  EXPECT_GT(moved, 0.1);  // the other one's vertices come in another order
}

TEST(TransferSampler, FacesFollowTheOrder) {
  const Corpus corpus = standing();
  TransferConfig c = small();
  const TransferBatch b = TransferSampler(corpus, c, 1).batch(0, 1);
  c.shuffle = false;
  const TransferBatch kept = TransferSampler(corpus, c, 1).batch(0, 1);
  ASSERT_EQ(b.faces.shape(), kept.faces.shape());
  for (int64_t i = 0; i < b.faces.numel(); ++i)
    EXPECT_LT((testing::at(b.identity, 0, static_cast<int64_t>(b.faces.item(i))) -
               testing::at(kept.identity, 0, static_cast<int64_t>(kept.faces.item(i))))
                  .norm(),
              1e-6);
}

TEST(TransferSampler, WhatCannotBeIsRefused) {
  TransferConfig c = small();
  c.points = 81;
  EXPECT_HAS(test::error_of<InputError>([&] { TransferSampler(training_corpus(), c, 1); }),
             "points");
  c = small();
  c.frames = 64;
  c.frame_step = 100000;
  EXPECT_THROW(TransferSampler(training_corpus(), c, 1), InputError);
  Corpus bare = training_corpus();
  bare.bodies[0].rest.faces.clear();
  EXPECT_HAS(test::error_of<InputError>([&] { TransferSampler(bare, small(), 1); }),
             "has no faces");
}

}  // namespace
}  // namespace restage
