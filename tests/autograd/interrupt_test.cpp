// Being asked to stop: by a host program, such as Python, that handles signals itself.
#include "autograd/base/interrupt.h"

#include <gtest/gtest.h>

#include <thread>

namespace restage {
namespace {

TEST(Interrupt, AHostIsAskedInItsOwnThreadWhileItIsThere) {
  EXPECT_FALSE(stop_requested());
  int asked = 0;
  bool stop = false;
  {
    const HostSignals outer([&] { return ++asked, stop; });
    EXPECT_FALSE(stop_requested());
    EXPECT_NO_THROW(throw_if_stopped());
    std::thread([] { EXPECT_FALSE(stop_requested()); }).join();
    EXPECT_EQ(asked, 2);
    {
      const HostSignals inner([] { return true; });
      EXPECT_TRUE(stop_requested());
    }
    EXPECT_FALSE(stop_requested()) << "what an inner one said is forgotten with it";
    stop = true;
    EXPECT_THROW(throw_if_stopped(), Interrupted);
  }
  EXPECT_FALSE(stop_requested());
}

TEST(Interrupt, InAScopeOtherThreadsAreToldWhatAHostSays) {
  const StopScope scope;
  const HostSignals host([] { return true; });
  std::thread([] { EXPECT_FALSE(stop_requested()); }).join();
  EXPECT_TRUE(stop_requested());
  std::thread([] { EXPECT_TRUE(stop_requested()); }).join();
}

/// Two threads of a host, each at a command of its own, in scopes that overlap.
TEST(Interrupt, AHostsWishIsForItsOwnCommandAndEndsWithIt) {
  const StopScope another;  // of a command that goes on
  {
    const HostSignals host([] { return true; });
    EXPECT_TRUE(stop_requested());
    std::thread([] {
      const HostSignals own([] { return false; });
      EXPECT_FALSE(stop_requested()) << "that of another thread";
    }).join();
  }
  const StopScope next;
  EXPECT_FALSE(stop_requested());
}

TEST(Interrupt, ANewScopeForgetsTheLastOne) {
  {
    const StopScope scope;
    ask_to_stop();
    EXPECT_TRUE(stop_requested());
  }
  const StopScope scope;
  EXPECT_FALSE(stop_requested());
}

}  // namespace
}  // namespace restage
