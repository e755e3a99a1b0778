// A program of its own, because it counts what every part of it takes from the heap: once warm, an
// online frame takes nothing, however many follow.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>

#include "infer/retargeter.h"
#include "tests/support/small_models.h"
#include "tests/support/tiny_body.h"
#include "tests/support/use_set.h"

namespace {
std::atomic<long> taken{0};
}  // namespace

// glibc's own functions under other names; what stands here takes their place in the whole program,
// libraries and operator new included.
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void* malloc(size_t n) { return ++taken, __libc_malloc(n); }
void* calloc(size_t n, size_t m) { return ++taken, __libc_calloc(n, m); }
void* realloc(void* p, size_t n) { return ++taken, __libc_realloc(p, n); }
void* memalign(size_t a, size_t n) { return ++taken, __libc_memalign(a, n); }
void* aligned_alloc(size_t a, size_t n) { return ++taken, __libc_memalign(a, n); }
int posix_memalign(void** p, size_t a, size_t n) {
  *p = (++taken, __libc_memalign(a, n));
  return *p == nullptr;
}
}

namespace restage {
namespace {

int64_t resident_pages() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  long total = 0, resident = 0;
  const int found = std::fscanf(file, "%ld %ld", &total, &resident);
  std::fclose(file);
  EXPECT_EQ(found, 2);
  return resident;
}

/// A walking scan: the same body, moved a little from frame to frame.
std::vector<Points> clouds() {
  const Mesh body = testing::tiny_body("a", "test").rest;
  std::vector<Points> out;
  for (uint64_t f = 0; f < 8; ++f) {
    out.push_back(surface_points(body, 200, RngKey{f, 0}));
    for (Point& p : out.back()) p += Point(0.02f * static_cast<float>(f), 0, 0);
  }
  return out;
}

/// The papers' motion network, or ours over an extractor that remembers, as the shipped weights
/// are.
Bundle chain(bool ours) {
  if (!ours) return testing::untrained_bundle("smrm/rot6d", {"hidden=32"}, 2);
  Bundle out = testing::untrained_bundle("smrm/hybrid", {"hidden=16", "contact=true"});
  out.put("skeleton", testing::untrained_model(
                          testing::kSmallExtractor,
                          {"points=64", "width=16", "layers=2", "centres=16", "neighbours=4",
                           "orientation=true", "uncertainty=true", "memory=true"},
                          Init{RngKey{5, 0}, DType::f32}));
  return testing::with_setting(out, "motion", "remove_heading", "true");
}

class SteadyFrames : public ::testing::TestWithParam<std::tuple<int, bool>> {
 protected:
  int threads() const { return std::get<0>(GetParam()); }
  const testing::UseThreads use_{threads()};
};

TEST(Counting, SeesTheHeap) {
  const long before = taken;
  const auto p = std::make_unique<int>(1);
  EXPECT_EQ(taken, before + *p);
}

TEST_P(SteadyFrames, TakeNothingFromTheHeapAndDoNotGrow) {
  const Bundle models = chain(std::get<1>(GetParam()));
  const Body target = testing::tiny_body("b", "test", 1.1, 1.2);
  Retargeter r(models, "w", target.rest, target.joints, {.samples = 2});
  const std::vector<Points> source = clouds();
  const std::string name = "frame";
  double moved = 0;
  const auto frames = [&](size_t n) {
    const System::Show show = [&](const RetargetedFrame& f) { moved += f.joints->front().norm(); };
    for (size_t i = 0; i < n; ++i) r.push(source[i % source.size()], name, show);
  };
  frames(200);
  reset_peak_memory();
  frames(50);
  const MemoryStats memory = memory_stats();
  const int64_t resident = resident_pages();
  const long count = taken;
  frames(threads() == 1 ? 10000 : 2000);
  // How many threads hold working memory at the same moment is chance, so with several of them the
  // pool may still take a few blocks, which stay; nothing may depend on the number of frames.
  const bool alone = threads() == 1;
  EXPECT_LE(taken - count, alone ? 0 : 64);
  EXPECT_GT(moved, 0);
  EXPECT_EQ(memory_stats().in_use, memory.in_use);
  EXPECT_LE(memory_stats().peak, memory.peak + (alone ? 0 : 1 << 20));
  EXPECT_EQ(memory_stats().large_allocations, memory.large_allocations);
  EXPECT_LE(resident_pages(), resident + 64);  // stacks of threads may still be touched
}

INSTANTIATE_TEST_SUITE_P(Threads, SteadyFrames,
                         ::testing::Combine(::testing::Values(0, 1, 2), ::testing::Bool()));

}  // namespace
}  // namespace restage
