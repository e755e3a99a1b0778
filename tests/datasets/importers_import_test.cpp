// `restage data import` as a function: data folders, BVH files and folders into schema files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "autograd/base/error.h"
#include "datasets/importers/import.h"
#include "datasets/importers/import_detail.h"
#include "datasets/schema.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

class ImportersImport : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "importers_import";
    fs::remove_all(folder_);
    fs::create_directories(folder_ + "/in");
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string out() const { return folder_ + "/out.h5"; }
  std::string folder_;
};

TEST_F(ImportersImport, DataFolderBecomesOneFile) {
  RESTAGE_NEED_DATA();
  // Two bodies and all clips: the whole set takes seconds more and shows nothing more.
  fs::create_directories(folder_ + "/in/body");
  fs::create_symlink(fs::absolute(test::data_folder() + "/cmu"), folder_ + "/in/cmu");
  fs::create_symlink(fs::absolute(test::data_folder() + "/body/makehuman.h5"),
                     folder_ + "/in/body/makehuman.h5");
  std::ifstream csv(test::data_folder() + "/body/bodies.csv");
  std::ofstream few(folder_ + "/in/body/bodies.csv");
  std::string line;
  for (int i = 0; i < 3 && std::getline(csv, line); ++i) few << line << "\n";
  few.close();

  const ImportSummary summary = import_data(folder_ + "/in", out());
  EXPECT_EQ(summary.bodies, 2u);
  EXPECT_EQ(summary.motions, 247u);
  EXPECT_TRUE(summary.skipped.empty());
  EXPECT_TRUE(verify(out()).empty());
  const std::vector<Body> bodies = read_bodies(out());
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].id, "b000");
  EXPECT_EQ(bodies[0].rest.vertices.size(), 13380u);
  EXPECT_EQ(bodies[1].rest.faces.size(), 26756u);
  const std::vector<Motion> test = read_motions(out(), "test");
  EXPECT_EQ(test.size(), 50u);
  for (const Motion& motion : test) EXPECT_FALSE(motion.action.empty());
  const Inspection inspection = inspect(out());
  EXPECT_NE(inspection.license.find("CC0"), std::string::npos);
  EXPECT_NE(inspection.provenance.find("mocap.cs.cmu.edu"), std::string::npos);
}

TEST_F(ImportersImport, FolderOfBvhFilesSkipsBadOnes) {
  std::ofstream(folder_ + "/in/02_walk.bvh") << bvh_test::text(bvh_test::Style());
  std::ofstream(folder_ + "/in/01_walk.BVH") << bvh_test::text(bvh_test::Style());
  std::ofstream(folder_ + "/in/03_bad.bvh") << "HIERARCHY\n";
  std::ofstream(folder_ + "/in/readme.txt") << "no motion\n";
  ImportOptions options;
  options.license = "CC0-1.0";
  options.motion.split = "test";
  const ImportSummary summary = import_data(folder_ + "/in", out(), options);
  EXPECT_EQ(summary.motions, 2u);
  ASSERT_EQ(summary.skipped.size(), 1u);
  EXPECT_NE(summary.skipped[0].find("03_bad.bvh:1"), std::string::npos);
  const std::vector<Motion> motions = read_motions(out(), "test");
  ASSERT_EQ(motions.size(), 2u);
  EXPECT_EQ(motions[0].id, "01_walk");
  EXPECT_EQ(motions[0].subject, "01");
  EXPECT_EQ(inspect(out()).license, "CC0-1.0");
}

TEST_F(ImportersImport, OfAFileAllGoesInOrNothing) {
  Body body;
  body.id = "b";
  body.split = "train";
  body.rest.vertices = {Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)};
  body.joints.fill(Vec3::Zero());
  body.weights.setZero(3, kJoints);
  body.weights.col(0).setOnes();
  Motion motion;
  motion.id = "m";
  motion.split = "train";
  motion.rest.fill(Vec3::Zero());
  motion.global.resize(1);
  motion.global[0].fill(Eigen::Quaternionf::Identity());
  motion.hips.assign(1, Point(0, 1, 0));
  ImportSummary summary;
  ImportWriter writer(out(), {}, summary);
  writer.add("first.glb", {}, {motion});
  EXPECT_THROW(writer.add("twins.glb", {body, body}, {}), InputError);
  try {
    writer.add("second.glb", {body}, {motion});
    ADD_FAILURE() << "two motions of one name";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "second.glb: its motion 'm' has the name of one in first.glb; rename one of the two");
  }
  writer.commit();
  EXPECT_EQ(summary.bodies, 0u);
  EXPECT_EQ(summary.motions, 1u);
  EXPECT_EQ(inspect(out()).kind, "motions");
}

TEST_F(ImportersImport, OptionsAreJudgedBeforeFiles) {
  ImportOptions options;
  options.motion.split = "nope";
  try {
    import_data("no such file", out(), options);
    ADD_FAILURE() << "an unknown split";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--split 'nope'"), std::string::npos) << error.what();
  }
}

TEST_F(ImportersImport, NothingIsLeftBehindByAFailure) {
  std::ofstream(folder_ + "/in/bad.bvh") << "no BVH";
  EXPECT_THROW(import_data(folder_ + "/in/bad.bvh", out()), InputError);
  EXPECT_THROW(import_data(folder_ + "/in", out()), InputError);
  EXPECT_THROW(import_data(folder_ + "/nothing", out()), InputError);
  fs::remove(folder_ + "/in/bad.bvh");
  EXPECT_THROW(import_data(folder_ + "/in", out()), InputError);                           // empty
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);  // "in"
}

}  // namespace
}  // namespace restage
