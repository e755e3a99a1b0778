// The same question has the same id, another one another.
#include "train/training/identity.h"

#include <gtest/gtest.h>

#include "tests/support/files.h"
#include "tests/train/tiny_training.h"

namespace restage {
namespace {

using testing::motion;
using testing::tiny_stage;
using testing::tiny_training;

/// An extractor of one seed and a motion network of another.
std::string weights(const test::TempDir& dir, uint64_t extractor, uint64_t network) {
  TrainConfig c = tiny_training(3);
  c.seed = extractor;
  Bundle out = tiny_stage("skeleton", c)->result();
  c.seed = network;
  out.add(tiny_stage("motion", c)->result());
  const std::string path =
      dir / (std::to_string(extractor) + "-" + std::to_string(network) + ".safetensors");
  save_bundle(path, out);
  return path;
}

struct Ids {
  std::string motion, trial;
  bool operator==(const Ids&) const = default;
};
Ids ids_of(const TrainConfig& c) {
  Identities identities;
  return {identities.stages(c).back().id, identities.trial(c, {})};
}

/// A motion network over the extractor of a file.
TrainConfig over(const std::string& path) {
  TrainConfig c = tiny_training(3);
  c.stages = {"skeleton", "motion"};
  c.section("skeleton").from = path;
  motion(c).answers.tracks.sequences = 4;
  return c;
}

TEST(Identity, OnlyTheNetworksThatAreTakenMatter) {
  const test::TempDir dir;
  const Ids first = ids_of(over(weights(dir, 1, 1)));
  EXPECT_EQ(ids_of(over(weights(dir, 1, 2))), first) << "the file's motion network is not read";
  const Ids other = ids_of(over(weights(dir, 2, 1)));
  EXPECT_NE(other.motion, first.motion);
  EXPECT_NE(other.trial, first.trial);
}

TEST(Identity, FilesWithoutTheNetworksAreRefused) {
  const test::TempDir dir;
  save_bundle(dir / "motion.safetensors", tiny_stage("motion", tiny_training(3))->result());
  EXPECT_HAS(test::refusal_of([&] { ids_of(over(dir / "motion.safetensors")); }),
             "motion.safetensors");
}

TEST(Identity, WhatChangesResultsChangesIt) {
  const test::TempDir dir;
  const std::string path = weights(dir, 1, 1);
  const Ids first = ids_of(over(path));
  TrainConfig same = over(path);
  same.name = "another name";
  same.loop.log_every = 7;
  EXPECT_EQ(ids_of(same), first);
  TrainConfig seed = over(path);
  ++seed.seed;
  EXPECT_NE(ids_of(seed).motion, first.motion);
  TrainConfig steps = over(path);
  ++motion(steps).optimiser.steps;
  EXPECT_NE(ids_of(steps).motion, first.motion);
}

}  // namespace
}  // namespace restage
