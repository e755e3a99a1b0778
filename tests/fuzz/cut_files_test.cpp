// A data file that is cut short, at every percent of its length: each time one clear line, except
// where the format goes line by line (OBJ, AMC, YAML) and what is left is a whole shorter file.
#include <gtest/gtest.h>

#include "tests/datasets/schema_support.h"
#include "tests/fuzz/targets.h"

namespace restage::fuzz {
namespace {

class CutFiles : public ::testing::TestWithParam<Target> {};

TEST_P(CutFiles, EverySeedIsRead) {
  for (const Seed& seed : seeds(GetParam().name)) {
    EXPECT_LE(seed.bytes.size(), GetParam().longest) << seed.name;
    EXPECT_NO_THROW(GetParam().read(seed.bytes)) << seed.name;
  }
}

TEST_P(CutFiles, EveryPercentIsOneClearLine) {
  for (const Seed& seed : seeds(GetParam().name)) {
    if (seed.cut == Cut::never_cut) continue;
    for (size_t percent = 0; percent < 100; ++percent) {
      const std::string cut = seed.bytes.substr(0, seed.bytes.size() * percent / 100);
      SCOPED_TRACE(seed.name + " at " + std::to_string(percent) + " %");
      if (seed.cut == Cut::refused) {
        test::error_of([&] { GetParam().read(cut); });
        continue;
      }
      try {
        GetParam().read(cut);
      } catch (const InputError&) {
        test::error_of([&] { GetParam().read(cut); });
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Readers, CutFiles, ::testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace restage::fuzz
