// The same question has the same id, another one another.
#include "train/training/identity.h"

#include <gtest/gtest.h>

#include <set>

#include "datasets/schema.h"
#include "nn/config/config.h"
#include "nn/weights/bundle.h"
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

  const Corpus all = load_corpus(same.data);
  write_dataset(dir / "data.h5", all.bodies, all.motions, {"Apache-2.0", "built in"});
  TrainConfig file = same;
  file.data = {dir / "data.h5"};
  TrainConfig alone = file;
  alone.data.subject = all.motions[0].subject;
  EXPECT_NE(ids_of(alone).motion, ids_of(file).motion);
  EXPECT_NE(ids_of(alone).trial, ids_of(file).trial);
}

/// Ids of the stages and of the trial that a configuration asks for.
std::vector<std::string> all_ids(const std::string& yaml) {
  TrainConfig c;
  read_config(parse_yaml(yaml, "test.yaml"), c);
  Identities identities;
  std::vector<std::string> out;
  for (const StageId& stage : identities.stages(c)) out.push_back(stage.name());
  out.push_back(identities.trial(c, {}));
  return out;
}

TEST(Identity, IsWhatItWasBeforeKeysWereAdded) {
  // As the program gave them before heads, scales and other sizes of models became keys; results
  // that are kept by id (experiments/studies/*/results, stores on disks) are found by them.
  EXPECT_EQ(all_ids("name: a\nseed: 5\n"),
            (std::vector<std::string>{"skeleton-b1e92605893d", "motion-a147f27e1ec3",
                                      "deformation-4a59121e61fc", "d9079e8e360f"}));
  const std::string ours =
      "skeleton: {model: skeleton/patch_transformer, sizes: {points: 256, memory: true, looks: "
      "2}}\n"
      "motion: {model: smrm/hybrid, sizes: {hidden: 64}}\n"
      "deformation: {model: deformation/bones}\n";
  EXPECT_EQ(all_ids(ours), (std::vector<std::string>{"skeleton-8659cbed9952", "motion-d7a80113bf39",
                                                     "deformation-06b801a4f79b", "0dc619052a00"}));
  EXPECT_EQ(all_ids("skeleton: {model: skeleton/pointnet}\nmotion: {model: smrm/quaternion}\n"
                    "deformation: {optimiser: {steps: 7}}\n"),
            (std::vector<std::string>{"skeleton-a3b241714384", "motion-f1849853ac1e",
                                      "deformation-565c90fee58b", "c28e6a543bb2"}));
  // The value that was fixed, said out loud, asks the same; another value asks something else.
  const auto with = [&](const std::string& size) {
    return all_ids(test::replaced(ours, "points: 256", "points: 256, " + size));
  };
  EXPECT_EQ(with("heads: 4"), all_ids(ours));
  EXPECT_EQ(with("patch_scale: 10.0"), all_ids(ours));
  for (const char* other : {"heads: 8", "patch: 32", "patch_scale: 9", "memory_scale: 4.5"})
    EXPECT_NE(with(other).front(), all_ids(ours).front()) << other;
  EXPECT_NE(all_ids("skeleton: {model: skeleton/pointnet, sizes: {widths: [8, 8, 8, 8, 8]}}\n")[0],
            all_ids("skeleton: {model: skeleton/pointnet}\n")[0]);
}

/// Keys that were added later change an id only where they change what comes out.
TEST(Identity, NewKeysOfTheTrainerChangeItWhereTheyAct) {
  const std::vector<std::string> plain = all_ids("seed: 5\n");
  const auto with = [](const std::string& yaml) { return all_ids("seed: 5\n" + yaml)[0]; };
  for (const char* same :
       {"skeleton: {optimiser: {groups: [], clip_value: 0, sgd: {momentum: 0}}}\n",
        "skeleton: {optimiser: {schedule: {power: 1, rise: 0.3}}}\n", "loop: {keep_best: 3}\n"})
    EXPECT_EQ(with(same), plain[0]) << same;
  std::set<std::string> others = {plain[0]};
  const char* const changes[] = {
      "skeleton: {optimiser: {groups: [{match: \"*\", rate: 0.5}]}}\n",
      "skeleton: {optimiser: {groups: [{match: \"*\", decay: 0.5}]}}\n",
      "skeleton: {optimiser: {clip_value: 1}}\n",
      "skeleton: {optimiser: {kind: lion}}\n",
      "skeleton: {optimiser: {kind: sgd, sgd: {momentum: 0.9}}}\n",
      "skeleton: {optimiser: {schedule: {kind: polynomial, power: 2}}}\n",
      "loop: {swa_from: 0.8}\n",
      "loop: {export: best}\n",
      "loop: {export: best, min_delta: 1}\n"};
  for (const char* other : changes) EXPECT_TRUE(others.insert(with(other)).second) << other;
}

TEST(Identity, OfNetworksIsWhatItWasBeforeKeysWereAdded) {
  Bundle b;
  for (const char* name : {"skeleton/patch_transformer", "smrm/hybrid", "deformation/weights"}) {
    const AnyConfig sizes = model_config(name, {});
    const Init init{RngKey{7, 0}, DType::f32};
    b.put(model_type(name).role, {name, sizes, make_model(name, sizes, init), {{"a", "b"}}});
  }
  const test::TempDir dir;
  save_bundle(dir / "w.safetensors", b);
  Identities identities;
  const std::pair<const char*, const char*> before[] = {
      {"skeleton", "069a64d46eff47be15ee92e0a9feeb7f1ec54e080739456f74dfc87069120b32"},
      {"motion", "d86182be5c37410299ee87f96ba251d03f0a562364dd93c513fec1251ce1553f"},
      {"deformation", "1d33c9c9759dac4e6d98f078782d7009bd93f5ef014cd5a27dd8c190f9f365f2"}};
  for (const auto& [stage, id] : before)
    EXPECT_EQ(identities.networks(stage, dir / "w.safetensors"), id) << stage;
}

}  // namespace
}  // namespace restage
