// Corpora: splits never mix, empty splits are errors, checksums notice every change. And what lets
// a training stop, resume and run for days: a sample is a function of seed and index alone, on any
// number of threads and in any batch, and drawing an epoch of them leaves nothing behind.
#include "datasets/corpus.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <functional>
#include <memory>
#include <set>

#include "datasets/builtin/bodies.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/evaluation.h"
#include "datasets/sampling/pairs.h"
#include "datasets/sampling/windows.h"
#include "datasets/schema.h"
#include "tests/datasets/sampling_support.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"
#include "tests/support/use_set.h"

#ifdef __has_feature
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__  // as GCC calls them
#elif __has_feature(thread_sanitizer)
#define __SANITIZE_THREAD__
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RESTAGE_SANITIZED
extern "C" size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace restage {
namespace {

using namespace testing;
using SamplingCorpus = test::FileTest;

TEST_F(SamplingCorpus, SplitsShareNoBodyAndNoSubject) {
  const Corpus all = tiny_corpus();
  std::set<std::string> seen;
  size_t bodies = 0, motions = 0;
  for (const char* split : {"train", "validation", "test"}) {
    const Corpus part = subset(all, split);
    const auto expect_own = [&](const auto& items) {
      for (const auto& item : items) {
        EXPECT_EQ(item.split, split);
        EXPECT_TRUE(seen.insert(item.id).second) << item.id;
      }
      return items.size();
    };
    bodies += expect_own(part.bodies);
    motions += expect_own(part.motions);
    EXPECT_EQ(part.license, all.license);
  }
  EXPECT_EQ(bodies, all.bodies.size());
  EXPECT_EQ(motions, all.motions.size());
}

TEST_F(SamplingCorpus, EmptyOrUnknownSplitsAreErrors) {
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

TEST_F(SamplingCorpus, BuiltinIsTheSameForEverySplitAloneAndTogether) {
  CorpusSource source;
  source.seed = 3;
  source.bodies = {1, 1, 0};
  source.motions = {2, 1, 0};
  const Corpus all = load_corpus(source);
  EXPECT_EQ(all.license, kBuiltinLicense);
  EXPECT_EQ(all.bodies.size(), 2u);
  EXPECT_EQ(all.motions.size(), 3u);
  EXPECT_FALSE(all.license.empty());
  EXPECT_EQ(checksum(subset(all, "train")), checksum(load_corpus(source, "train")));
  EXPECT_NE(checksum(subset(all, "train")), checksum(subset(all, "validation")));
}

TEST_F(SamplingCorpus, OfOneSubjectOnlyTheTrainingIsLess) {
  Corpus all = tiny_corpus();
  std::string one;
  for (size_t i = 0; i < all.motions.size(); ++i) {
    Motion& motion = all.motions[i];
    motion.subject = motion.split + std::to_string(i);
    if (motion.split == "train" && one.empty()) one = motion.subject;
  }
  const std::string path = dir / "people.h5";
  write_dataset(path, all.bodies, all.motions, {"Apache-2.0", "boxes"});
  CorpusSource source{path}, alone{path};
  alone.subject = one;
  ASSERT_GT(load_corpus(source, "train").motions.size(), 1u);
  const Corpus train = load_corpus(alone, "train");
  ASSERT_EQ(train.motions.size(), 1u);
  EXPECT_EQ(train.motions[0].subject, one);
  EXPECT_EQ(train.bodies.size(), load_corpus(source, "train").bodies.size());
  EXPECT_EQ(checksum(load_corpus(alone, "test")), checksum(load_corpus(source, "test")));
  EXPECT_EQ(checksum(subset(load_corpus(alone), "train")), checksum(train));
  alone.subject = "nobody";
  EXPECT_HAS(test::refusal_of([&] { load_corpus(alone, "train"); }), "'" + one + "'");
}

TEST_F(SamplingCorpus, FilesComeBackAsTheyWereWritten) {
  const Corpus all = tiny_corpus();
  const std::string path = dir / "boxes.h5";
  write_dataset(path, all.bodies, all.motions, {"Apache-2.0", "boxes"});
  const Corpus validation = load_corpus({path}, "validation");
  EXPECT_EQ(validation.bodies.size(), 2u);
  EXPECT_EQ(validation.motions.size(), 2u);
  EXPECT_EQ(validation.description, "boxes");
  EXPECT_EQ(validation.license, "Apache-2.0");
  EXPECT_EQ(checksum(load_corpus({path}, "test")), checksum(subset(load_corpus({path}), "test")));

  // What is of no known split is not left out without a word.
  std::vector<Motion> lost = all.motions;
  lost.back().split = "trian";
  write_dataset(dir / "lost.h5", all.bodies, lost, {"Apache-2.0", "boxes"});
  EXPECT_HAS(test::refusal_of([&] { load_corpus({dir / "lost.h5"}, "train"); }), "'trian'");

  // Licence, provenance and the definition of the joints change no number.
  std::vector<Body> said = all.bodies;
  for (Body& body : said) body.definition = "smpl";
  write_dataset(dir / "said.h5", said, all.motions, {"CC0", "other words"});
  EXPECT_EQ(content_of_file(dir / "said.h5"), content_of_file(path));
  std::vector<Motion> moved = all.motions;
  moved.back().subject = "somebody of the same split";
  write_dataset(dir / "said.h5", said, moved, {"CC0", "other words"});
  EXPECT_NE(content_of_file(dir / "said.h5"), content_of_file(path))
      << "own bodies are drawn by it";
  Corpus shaped = all;
  auto shapes = std::make_shared<PoseBlendShapes>();
  shapes->directions.setConstant(3 * std::ssize(shaped.bodies[0].rest.vertices),
                                 PoseBlendShapes::kFeatures, 0.01f);
  shaped.bodies[0].blend_shapes = shapes;
  EXPECT_NE(checksum(shaped), checksum(all));
  said.back().joints[3].x() += 1e-6;
  write_dataset(dir / "said.h5", said, all.motions, {"CC0", "other words"});
  EXPECT_NE(content_of_file(dir / "said.h5"), content_of_file(path));

  // A subject in two splits.
  std::vector<Motion> mixed = all.motions;
  mixed.back().subject = mixed.front().subject;
  write_dataset(path, all.bodies, mixed, {"Apache-2.0", "boxes"});
  EXPECT_THROW(load_corpus({path}), InputError);
}

TEST_F(SamplingCorpus, AFolderHoldsAFileForEachSplit) {
  const Corpus all = tiny_corpus(), train = subset(all, "train");
  write_dataset(dir / "train.h5", train.bodies, train.motions, {"x", "boxes"});
  EXPECT_EQ(checksum(load_corpus({dir.path()}, "train")), checksum(train));
  EXPECT_THROW(load_corpus({dir.path()}, "test"), InputError);  // no such file
  EXPECT_THROW(load_corpus({dir.path()}), InputError);          // which?
  // A file whose bodies are of another split than its name says.
  std::filesystem::rename(dir / "train.h5", dir / "test.h5");
  EXPECT_THROW(load_corpus({dir.path()}, "test"), InputError);
}

TEST_F(SamplingCorpus, ChecksumNoticesSmallChanges) {
  const Corpus all = tiny_corpus();
  const std::string before = checksum(all);
  EXPECT_EQ(before.size(), 64u);
  EXPECT_EQ(before, checksum(tiny_corpus()));
  const std::function<void(Corpus&)> changes[] = {
      [](Corpus& c) { c.bodies[2].rest.vertices[5].y() += 1e-6f; },
      [](Corpus& c) { c.motions[1].global[3][4].x() += 1e-6f; },
      [](Corpus& c) { c.motions[1].split = "test"; }};
  for (const auto& change : changes) {
    Corpus changed = all;
    change(changed);
    EXPECT_NE(before, checksum(changed));
  }
}

// ---- samples
// -------------------------------------------------------------------------------------

/// A stage's sampler with everything that it can draw.
struct Loader {
  std::string name;
  std::function<std::vector<Tensor>(int64_t first, int64_t n)> batch;
};

/// `size`: points of a sample.
Loader clouds(const Corpus& corpus, int size, uint64_t seed) {
  const CloudConfig c{
      .points = size, .scale_jitter = 0.1, .min_fraction = 0.5, .skin_weights = true};
  const auto sampler = std::make_shared<CloudSampler>(corpus, c, seed);
  return {"clouds", [sampler](int64_t first, int64_t n) {
            const CloudBatch b = sampler->batch(first, n);
            return std::vector<Tensor>{b.points, b.joints, b.weights};
          }};
}

Loader windows(const Corpus& corpus, int frames, uint64_t seed) {
  const WindowConfig c{.frames = frames,
                       .noise = 0.01,
                       .noise_correlation = 0.5,
                       .noisy_translation = true,
                       .truth = true};
  const auto sampler = std::make_shared<WindowSampler>(corpus, c, seed);
  return {"windows", [sampler](int64_t first, int64_t n) {
            const WindowBatch b = sampler->batch(first, n);
            return std::vector<Tensor>{
                b.joints_a, b.input_a,       b.trans_a,      b.input_trans_a, b.rest_a,
                b.rest_b,   b.sixd_a,        b.self_mask,    b.real_b,        b.real_trans_b,
                b.truth_b,  b.truth_trans_b, b.truth_sixd_b, b.root_a,        b.truth_root_b};
          }};
}

Loader pairs(const Corpus& corpus, int size, uint64_t seed) {
  const auto sampler = std::make_shared<PairSampler>(corpus, PairConfig{size, true, true}, seed);
  return {"pairs", [sampler](int64_t first, int64_t n) {
            const PairBatch b = sampler->batch(first, n);
            return std::vector<Tensor>{b.rest_points, b.posed_points, b.rest_joints, b.local,
                                       b.axis_angle};
          }};
}

std::vector<Loader> loaders(const Corpus& corpus, int size, uint64_t seed) {
  return {clouds(corpus, size, seed), windows(corpus, size, seed), pairs(corpus, size, seed)};
}

/// All bits of one sample of a batch.
std::string bits(const std::vector<Tensor>& batch, int64_t row) {
  std::string out;
  for (const Tensor& t : batch) {
    const int64_t n = t.numel() / t.size(0);
    out.append(reinterpret_cast<const char*>(t.data<float>() + row * n),
               static_cast<size_t>(n) * sizeof(float));
  }
  return out;
}

class SamplingEpoch : public ::testing::Test {
 protected:
  const Corpus& corpus_ = training_corpus();
};

TEST_F(SamplingEpoch, SamplesAreFunctionsOfSeedAndIndex) {
  const std::vector<int64_t> indices = {0, 1, 6, 31, 64999};
  for (size_t which = 0; which < 3; ++which) {
    const auto fresh = [&](uint64_t seed) { return loaders(corpus_, 20, seed)[which]; };
    std::vector<std::string> direct;  // each the first thing that its sampler draws
    for (const int64_t i : indices) direct.push_back(bits(fresh(3).batch(i, 1), 0));
    for (size_t k = 1; k < indices.size(); ++k) EXPECT_FALSE(direct[k] == direct[k - 1]);
    EXPECT_FALSE(bits(fresh(4).batch(6, 1), 0) == direct[2]) << "the seed is of no effect";

    for (const int n : {1, 2, 3}) {
      const UseThreads use(n);
      const Loader one = fresh(3);  // draws everything, last index first, alone and in batches
      for (size_t k = indices.size(); k-- > 0;)
        for (const int64_t batch : {1, 7, 16}) {
          const int64_t first = indices[k] / batch * batch;
          EXPECT_TRUE(bits(one.batch(first, batch), indices[k] - first) == direct[k])
              << one.name << " " << indices[k] << " in a batch of " << batch << " on " << n;
        }
    }
  }
}

/// Asked for and not freed, everywhere in the process.
int64_t heap_bytes() {
#ifdef RESTAGE_SANITIZED
  return static_cast<int64_t>(__sanitizer_get_current_allocated_bytes());
#else
  const struct mallinfo2 info = mallinfo2();
  return static_cast<int64_t>(info.uordblks + info.hblkhd);
#endif
}

// Samples are small, so that an epoch takes seconds; `./run bench` does it with the real ones.
TEST_F(SamplingEpoch, MemoryIsFlatOverAnEpochOf65000Examples) {
  constexpr int64_t kBatch = 16;
#ifdef RESTAGE_SANITIZED
  constexpr int64_t kFew = 1000, kEpoch = 13000;  // sanitizers make it ten times as slow
#else
  constexpr int64_t kFew = 5000, kEpoch = 65000;
#endif
  // Two bytes an example: room for the few blocks that threads keep for themselves.
  constexpr int64_t kGrowth = 2 * (kEpoch - kFew);
  for (const Loader& loader : loaders(corpus_, 6, 1)) {
    int64_t heap = 0, tensors = 0;
    for (int64_t done = 0; done < kEpoch; done += kBatch) {
      loader.batch(done, kBatch);
      if (done < kFew && done + kBatch >= kFew) {
        heap = heap_bytes();
        tensors = memory_stats().in_use;
      }
    }
    EXPECT_EQ(memory_stats().in_use, tensors) << loader.name;
    EXPECT_LT(heap_bytes() - heap, kGrowth) << loader.name;
  }
}

/// Shares of samples in which body 1 performs the motion of the person whose id it has, and any
/// other motion.
template <class Drawn>
std::pair<double, double> shares_of_own(const Drawn& drawn) {
  constexpr int kSamples = 3000;
  double own = 0, all_own = 0, other = 0, all_other = 0;
  for (int64_t i = 0; i < kSamples; ++i) {
    const auto [body, motion] = drawn(i);
    if (motion == 0)
      all_own += 1, own += body == 1;
    else
      all_other += 1, other += body == 1;
  }
  return {own / all_own, other / all_other};
}

TEST(SamplingOwnBodies, EverySecondSampleOfAPersonsMotionIsOfTheirOwnBody) {
  Corpus corpus = training_corpus();
  ASSERT_EQ(corpus.bodies.size(), 3u);
  corpus.bodies[1].id = corpus.motions[0].subject;
  const CloudSampler clouds(corpus, {.tpose_share = 0}, 1);
  const WindowSampler windows(corpus, {.frames = 8}, 1);
  const auto of_clouds = shares_of_own([&](int64_t i) {
    const CloudSubject s = clouds.subject(i);
    return std::pair(s.body, s.at.motion);
  });
  const auto of_windows = shares_of_own([&](int64_t i) {
    const WindowSubject s = windows.subject(i);
    EXPECT_EQ(s.self, s.body_a == s.body_b);
    return std::pair(s.body_a, s.clip.motion);
  });
  for (const auto& [own, other] : {of_clouds, of_windows}) {
    EXPECT_NEAR(own, 0.5 + 0.5 / 3, 0.06);
    EXPECT_NEAR(other, 1.0 / 3, 0.06);
  }
  for (const EvalSequence& s : evaluation_sequences(corpus, 12, 8, 1)) {
    EXPECT_TRUE(s.motion != 0 || s.body_a == 1);
    EXPECT_NE(s.body_a, s.body_b);
  }
}

}  // namespace
}  // namespace restage
