// What a machine may lack is a reason to skip a test, except in CI, whose word then means less than
// it says. Only what CI cannot have made, such as a processor's instructions, is skipped there too.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

/// Ends a test that needs `what`: skipped with that reason, or, where RESTAGE_CI is set, failed.
#define RESTAGE_LACKS(what)                                                                      \
  do {                                                                                           \
    if (std::getenv("RESTAGE_CI") != nullptr) FAIL() << "lacking, and required in CI: " << what; \
    GTEST_SKIP() << what;                                                                        \
  } while (false)
