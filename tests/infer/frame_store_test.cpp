#include "infer/render/frame_store.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "autograd/base/error.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using Store = FrameStore<float>;

/// Frames of 1 MB: more of them than are in memory at once.
Store numbered(int frames) {
  Store out;
  for (int f = 0; f < frames; ++f) out.push_back(std::vector<float>(250000, static_cast<float>(f)));
  return out;
}

TEST(FrameStore, FramesThatWerePutAwayComeBack) {
  const Store store = numbered(200);
  ASSERT_EQ(store.size(), 200u);
  int f = 0;
  for (const auto& frame : store) {
    ASSERT_EQ(frame.size(), 250000u);
    EXPECT_EQ(frame[7], static_cast<float>(f++));
  }
  const auto& first = store[0];
  for (size_t k = 1; k < Store::kFrames; ++k) EXPECT_EQ(store[k].back(), static_cast<float>(k));
  EXPECT_EQ(first[7], 0.0f) << "good while no more than so many others are used";
}

TEST(FrameStore, WhatIsDoneToAFrameIsKept) {
  Store store = numbered(100);
  store[3].pop_back();
  store[4][9] = -1;
  const Store copy = store;
  for (auto& frame : store) frame.resize(2);
  for (size_t f = 0; f < 100; ++f) {
    EXPECT_EQ(std::as_const(store)[f].size(), 2u);
    EXPECT_EQ(copy[f].size(), f == 3 ? 249999u : 250000u) << "a copy is another list";
  }
  EXPECT_EQ(copy[4][9], -1.0f);
  auto& last = store.emplace_back();  // filled after it is in the list
  last.assign(5, 2.5f);
  store.assign(3, last);
  EXPECT_EQ(store.size(), 3u);
  EXPECT_EQ(std::as_const(store).back(), std::vector<float>(5, 2.5f));
}

class FrameStoreFiles : public test::FileTest {
 protected:
  FrameStoreFiles() {
    if (const char* value = std::getenv("TMPDIR")) before_ = value;
  }
  ~FrameStoreFiles() override {
    if (before_)
      ::setenv("TMPDIR", before_->c_str(), 1);
    else
      ::unsetenv("TMPDIR");
  }

 private:
  std::optional<std::string> before_;
};

TEST_F(FrameStoreFiles, FramesArePutAwayWhereTheUserWantsThem) {
  std::filesystem::create_directory(dir / "mine");
  ::setenv("TMPDIR", std::string(dir / "mine").c_str(), 1);
  EXPECT_EQ(numbered(100).size(), 100u);
  EXPECT_TRUE(std::filesystem::is_empty(dir / "mine")) << "nothing is left";
  ::setenv("TMPDIR", std::string(dir / "not there").c_str(), 1);
  EXPECT_THROW(numbered(100), WorkError);
}

}  // namespace
}  // namespace restage
