// Where the open bodies and motions lie, for tests that need real ones.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/lacking.h"

namespace restage::test {

/// RESTAGE_SHARED/data, else ../shared/data beside the repository; it may not be there.
inline std::string data_folder() {
  const char* shared = std::getenv("RESTAGE_SHARED");
  return (shared ? std::string(shared) : RESTAGE_SOURCE_DIR "/../shared") + "/data";
}

}  // namespace restage::test

/// Ends a test that needs the data folder where there is none.
#define RESTAGE_NEED_DATA()                                                          \
  if (!std::filesystem::exists(restage::test::data_folder() + "/cmu/clips30.h5") ||  \
      !std::filesystem::exists(restage::test::data_folder() + "/body/makehuman.h5")) \
  RESTAGE_LACKS("no data folder (set RESTAGE_SHARED): its bodies and motions are not at hand")
