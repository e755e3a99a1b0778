// What takes long is said, and what does not is not.
#include "experiments/slow_work.h"

#include <gtest/gtest.h>

#include "autograd/base/log.h"
#include "tests/support/files.h"

namespace restage {
namespace {

TEST(SlowWork, OnlyWhatTakesLongIsSaid) {
  const test::TempDir dir;
  set_log_file(dir / "log.txt");
  { SlowWork().on("something short"); }
  {
    SlowWork waiting;
    waiting.on("something that is over by then");
    waiting.on("something long");
    std::this_thread::sleep_for(std::chrono::milliseconds(2300));
    waiting.on("");
  }
  set_log_file("");
  const std::string said = test::bytes_of(dir / "log.txt");
  EXPECT_HAS(said, "still at work: something long\n");
  EXPECT_EQ(said.find("short"), std::string::npos) << said;
  EXPECT_EQ(said.find("over"), std::string::npos) << said;
}

}  // namespace
}  // namespace restage
