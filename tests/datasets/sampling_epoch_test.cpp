// What lets a training stop, resume and run for days: a sample is a function of seed and index
// alone, and drawing an epoch of them leaves nothing behind.
#include <gtest/gtest.h>
#include <malloc.h>

#include <functional>
#include <memory>

#include "autograd/base/parallel.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/pairs.h"
#include "datasets/sampling/windows.h"
#include "tests/support/tiny_body.h"

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

/// A stage's sampler with everything that it can draw.
struct Loader {
  std::string name;
  std::function<std::vector<Tensor>(int64_t first, int64_t n)> batch;
};

/// `size`: points of a sample.
Loader clouds(const Corpus& corpus, int size, uint64_t seed) {
  CloudConfig c;
  c.points = size;
  c.min_fraction = 0.5;
  c.scale_jitter = 0.1;
  c.skin_weights = true;
  const auto sampler = std::make_shared<CloudSampler>(corpus, c, seed);
  return {"clouds", [sampler](int64_t first, int64_t n) {
            const CloudBatch b = sampler->batch(first, n);
            return std::vector<Tensor>{b.points, b.joints, b.weights};
          }};
}

Loader windows(const Corpus& corpus, int frames, uint64_t seed) {
  WindowConfig c;
  c.frames = frames;
  c.noise = 0.01;
  c.noise_correlation = 0.5;
  c.noisy_translation = true;
  c.truth = true;
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
  ~SamplingEpoch() override { set_threads(0); }
  const Corpus corpus_ = subset(testing::tiny_corpus(), "train");
};

TEST_F(SamplingEpoch, SamplesAreFunctionsOfSeedAndIndex) {
  const std::vector<int64_t> indices = {0, 1, 6, 31, 64999};
  for (size_t which = 0; which < 3; ++which) {
    const auto fresh = [&](uint64_t seed) { return loaders(corpus_, 20, seed)[which]; };
    set_threads(1);
    std::vector<std::string> direct;  // each the first thing that its sampler draws
    for (const int64_t i : indices) direct.push_back(bits(fresh(3).batch(i, 1), 0));
    for (size_t k = 1; k < indices.size(); ++k) EXPECT_FALSE(direct[k] == direct[k - 1]);
    EXPECT_FALSE(bits(fresh(4).batch(6, 1), 0) == direct[2]) << "the seed is of no effect";

    for (const int n : {1, 2, 3}) {
      set_threads(n);
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

}  // namespace
}  // namespace restage
