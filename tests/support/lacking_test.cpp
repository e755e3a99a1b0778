// In CI a test that lacks what it needs fails.
#include "tests/support/lacking.h"

#include <gtest/gtest-spi.h>

#include "tests/support/data_folder.h"

namespace restage {
namespace {

class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old, had_ = true;
    ::setenv(name, value, 1);
  }
  ~Variable() { had_ ? ::setenv(name_, old_.c_str(), 1) : ::unsetenv(name_); }

 private:
  const char* name_;
  std::string old_;
  bool had_ = false;
};

TEST(Lacking, InCiAMissingDataFolderIsAFailure) {
  const Variable ci("RESTAGE_CI", "1"), nowhere("RESTAGE_SHARED", "/nowhere");
  EXPECT_FATAL_FAILURE(RESTAGE_NEED_DATA(), "no data folder");
}

}  // namespace
}  // namespace restage
