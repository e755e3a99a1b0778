// The store: what is whole is read, what is damaged is made again, and what cannot be read is
// neither.
#include "train/artifacts/store.h"

#include <gtest/gtest.h>

#include "autograd/base/atomic_file.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"
#include "tests/train/tiny_training.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;

class StoreTest : public FileTest {
 protected:
  /// The artifact; says whether it was made.
  bool got() {
    const int before = made_;
    store_.get(id_, "steps: 3\n", [this](RunDir&) {
      ++made_;
      return testing::tiny_stage("skeleton", testing::tiny_training(3))->result();
    });
    return made_ > before;
  }
  std::string file(const char* name) const { return store_.path(id_) + "/" + name; }
  Names content() const { return names_in(dir / "store"); }

  const StageId id_{"skeleton", "0123456789ab", "{}"};
  const Store store_{dir / "store"};
  const Names whole_{"skeleton-0123456789ab"};

 private:
  int made_ = 0;
};

TEST_F(StoreTest, WhatIsThereIsNotMadeAgain) {
  EXPECT_FALSE(store_.find(id_));
  EXPECT_FALSE(store_.has(id_));
  EXPECT_TRUE(got());
  EXPECT_TRUE(store_.has(id_));
  EXPECT_FALSE(got());
  EXPECT_EQ(content(), whole_);
}

TEST_F(StoreTest, BytesThatDoNotFitAreMadeAgain) {
  got();
  for (const char* name : {"weights.safetensors", "config.yaml", "metrics.jsonl"}) {
    write_bytes(file(name), bytes_of(file(name)) + " ");
    EXPECT_TRUE(got()) << name;
    EXPECT_TRUE(fs::exists(store_.path(id_) + ".damaged"));
    EXPECT_FALSE(got());
  }
  fs::remove(file("config.yaml"));
  EXPECT_TRUE(got()) << "a file that is missing";
  write_bytes(file("artifact.json"), "{");
  EXPECT_TRUE(got());
}

TEST_F(StoreTest, WhatCannotBeReadIsNotDamaged) {
  if (!RESTAGE_FILES_MAY_RUN_OUT) GTEST_SKIP() << "UBSan needs a free file to look at objects";
  got();
  {
    const NoMoreFiles limit;
    expect_error<ReadError>([&] { store_.find(id_); }, {"open files", store_.path(id_)});
  }
  for (const char* name : {"artifact.json", "weights.safetensors", "metrics.jsonl"}) {
    const Unreadable loop(file(name));
    expect_error<ReadError>([&] { got(); }, {file(name), "symbolic links"});
  }
  EXPECT_EQ(content(), whole_) << "moved aside";
  EXPECT_FALSE(got());
}

TEST_F(StoreTest, AFailingDiskIsNotDamage) {
  got();
  const std::string name = file("metrics.jsonl"), good = bytes_of(name);
  fs::remove(name);
  fs::create_symlink("/proc/self/mem", name);  // opens like a file, and cannot be read
  if (!fs::exists(name)) GTEST_SKIP() << "there is no /proc/self/mem here";
  expect_error<ReadError>([&] { got(); }, {name, "rror"});
  fs::remove(name);
  write_bytes(name, good);
  EXPECT_EQ(content(), whole_);
  EXPECT_FALSE(got());
}

TEST_F(StoreTest, AStoreThatCannotBeSeenIsNotEmpty) {
  got();
  const Unreadable loop(store_.path(id_));
  EXPECT_THROW(got(), ReadError);
  EXPECT_THROW(store_.has(id_), ReadError);
}

}  // namespace
}  // namespace restage
