// Corpora: splits never mix, empty splits are errors, checksums notice every change.
#include "datasets/corpus.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "autograd/base/error.h"
#include "datasets/schema.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using testing::tiny_corpus;

TEST(SamplingCorpus, SplitsShareNoBodyAndNoSubject) {
  const Corpus all = tiny_corpus();
  std::set<std::string> seen;
  size_t bodies = 0, motions = 0;
  for (const char* split : {"train", "validation", "test"}) {
    const Corpus part = subset(all, split);
    for (const Body& body : part.bodies) {
      EXPECT_EQ(body.split, split);
      EXPECT_TRUE(seen.insert(body.id).second);
    }
    for (const Motion& motion : part.motions) {
      EXPECT_EQ(motion.split, split);
      EXPECT_TRUE(seen.insert(motion.id).second);
    }
    bodies += part.bodies.size();
    motions += part.motions.size();
    EXPECT_EQ(part.license, all.license);
  }
  EXPECT_EQ(bodies, all.bodies.size());
  EXPECT_EQ(motions, all.motions.size());
}

TEST(SamplingCorpus, EmptyOrUnknownSplitsAreErrors) {
  Corpus all = tiny_corpus();
  EXPECT_THROW(subset(all, "training"), InputError);
  for (Motion& motion : all.motions) motion.split = "train";
  EXPECT_NO_THROW(subset(all, "train"));
  EXPECT_THROW(subset(all, "test"), InputError);
  EXPECT_THROW(load_corpus({"no such file.h5"}), InputError);
  CorpusSource none;
  none.motions = {0, 0, 0};
  none.bodies = {1, 0, 0};
  EXPECT_THROW(load_corpus(none, "train"), InputError);
  EXPECT_THROW(load_corpus(none, "everything"), InputError);
}

TEST(SamplingCorpus, BuiltinIsTheSameForEverySplitAloneAndTogether) {
  CorpusSource source;
  source.seed = 3;
  source.bodies = {1, 1, 0};
  source.motions = {2, 1, 0};
  const Corpus all = load_corpus(source);
  EXPECT_EQ(all.bodies.size(), 2u);
  EXPECT_EQ(all.motions.size(), 3u);
  EXPECT_FALSE(all.license.empty());
  EXPECT_EQ(checksum(subset(all, "train")), checksum(load_corpus(source, "train")));
  EXPECT_NE(checksum(subset(all, "train")), checksum(subset(all, "validation")));
}

TEST(SamplingCorpus, FilesComeBackAsTheyWereWritten) {
  const Corpus all = tiny_corpus();
  const std::string path =
      (std::filesystem::temp_directory_path() / "restage_sampling_corpus_test.h5").string();
  write_dataset(path, all.bodies, all.motions, {"Apache-2.0", "boxes"});
  const Corpus validation = load_corpus({path}, "validation");
  EXPECT_EQ(validation.bodies.size(), 2u);
  EXPECT_EQ(validation.motions.size(), 2u);
  EXPECT_EQ(validation.description, "boxes");
  EXPECT_EQ(validation.license, "Apache-2.0");
  EXPECT_EQ(checksum(load_corpus({path}, "test")), checksum(subset(load_corpus({path}), "test")));

  // A subject in two splits.
  std::vector<Motion> mixed = all.motions;
  mixed.back().subject = mixed.front().subject;
  write_dataset(path, all.bodies, mixed, {"Apache-2.0", "boxes"});
  EXPECT_THROW(load_corpus({path}), InputError);
  std::filesystem::remove(path);
}

TEST(SamplingCorpus, AFolderHoldsAFileForEachSplit) {
  const Corpus all = tiny_corpus(), train = subset(all, "train");
  const auto folder = std::filesystem::temp_directory_path() / "restage_sampling_corpus_folder";
  std::filesystem::create_directories(folder);
  write_dataset((folder / "train.h5").string(), train.bodies, train.motions, {"x", "boxes"});
  EXPECT_EQ(checksum(load_corpus({folder.string()}, "train")), checksum(train));
  EXPECT_THROW(load_corpus({folder.string()}, "test"), InputError);  // no such file
  EXPECT_THROW(load_corpus({folder.string()}), InputError);          // which?
  // A file whose bodies are of another split than its name says.
  std::filesystem::rename(folder / "train.h5", folder / "test.h5");
  EXPECT_THROW(load_corpus({folder.string()}, "test"), InputError);
  std::filesystem::remove_all(folder);
}

TEST(SamplingCorpus, ChecksumNoticesSmallChanges) {
  const Corpus all = tiny_corpus();
  const std::string before = checksum(all);
  EXPECT_EQ(before.size(), 16u);
  EXPECT_EQ(before, checksum(tiny_corpus()));
  Corpus changed = all;
  changed.bodies[2].rest.vertices[5].y() += 1e-6f;
  EXPECT_NE(before, checksum(changed));
  changed = all;
  changed.motions[1].global[3][4].x() += 1e-6f;
  EXPECT_NE(before, checksum(changed));
  changed = all;
  changed.motions[1].split = "test";
  EXPECT_NE(before, checksum(changed));
}

}  // namespace
}  // namespace restage
