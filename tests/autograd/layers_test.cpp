// The include directions of docs/design/architecture.md hold, and the script sees a broken one.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/lacking.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Exit code of the script for a source tree, -1 if there is no Python.
int check_layers(const std::string& root, const std::string& output = "") {
  if (std::system("python3 -c pass > /dev/null 2>&1") != 0) return -1;
  const std::string command =
      "python3 '" RESTAGE_SOURCE_DIR "/cmake/check_layers.py' '" + root + "'" + output;
  return WEXITSTATUS(std::system(command.c_str()));
}

TEST(Layers, PointOneWay) {
  const int code = check_layers(RESTAGE_SOURCE_DIR);
  if (code < 0) RESTAGE_LACKS("python3 is missing");
  EXPECT_EQ(code, 0) << "see the lines above; the rule is in docs/design/architecture.md";
}

TEST(Layers, ABrokenArrowIsSeen) {
  std::string root = (fs::temp_directory_path() / "restage-layers-XXXXXX").string();
  ASSERT_NE(::mkdtemp(root.data()), nullptr);
  const auto with = [&](const std::string& file, const std::string& line) {
    fs::remove_all(root);
    const fs::path path = fs::path(root) / file;
    fs::create_directories(path.parent_path());
    std::ofstream(path) << line << "\n";
    return check_layers(root, " > /dev/null");
  };
  const int fine = with("autograd/ops/x.h", "#include \"autograd/tape/tape.h\"");
  if (fine < 0) RESTAGE_LACKS("python3 is missing");
  EXPECT_EQ(fine, 0);
  EXPECT_EQ(with("train/stages/x.cpp", "#include \"datasets/schema.h\""), 0);
  EXPECT_EQ(with("autograd/tape/x.h", "#include \"autograd/ops/reduce.h\""), 1);
  EXPECT_EQ(with("autograd/ops/x.cpp", "#include \"autograd/cpu/pool.h\""), 1);
  EXPECT_EQ(with("train/trainer.cpp", "#include \"datasets/schema.h\""), 1);
  EXPECT_EQ(with("infer/x.cpp", "#include \"train/run.h\""), 1);
  EXPECT_EQ(with("nn/models/x.cpp", "#include \"train/run.h\""), 1);
  EXPECT_EQ(with("nn/models/x.cpp", "#include <tbb/parallel_for.h>"), 1);
  EXPECT_EQ(with("autograd/unknown/x.cpp", "#include \"autograd/base/rng.h\""), 1);
  fs::remove_all(root);
}

}  // namespace
}  // namespace restage
