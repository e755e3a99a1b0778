// MakeHuman bodies against the data folder's reference tool (tests/golden/bodies.json).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "autograd/base/error.h"
#include "datasets/importers/makehuman.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string body_folder() { return test::data_folder() + "/body"; }

json golden() {
  std::ifstream in(RESTAGE_SOURCE_DIR "/tests/golden/bodies.json");
  return json::parse(in);
}

double difference(const json& expected, const Vec3& value) {
  return (Vec3(expected.at(0), expected.at(1), expected.at(2)) - value).norm();
}

TEST(ImportersMakeHuman, BodiesEqualThoseOfTheReferenceTool) {
  RESTAGE_NEED_DATA();
  const MakeHuman model(body_folder());
  const std::vector<BodyRecipe> recipes = read_recipes(body_folder() + "/bodies.csv");
  ASSERT_EQ(recipes.size(), 160u);
  const json all = golden();  // outlives the loop
  for (const json& expected : all.at("bodies")) {
    const Body body = model.build(recipes.at(expected.at("row").get<size_t>()));
    EXPECT_EQ(body.id, expected.at("id"));
    EXPECT_EQ(body.split, expected.at("split"));
    ASSERT_EQ(body.rest.vertices.size(), 13380u);
    ASSERT_EQ(body.rest.faces.size(), 26756u);
    for (size_t i = 0; i < expected.at("pick").size(); ++i) {
      const size_t v = expected.at("pick").at(i);
      EXPECT_LT(difference(expected.at("vertices").at(i), body.rest.vertices[v].cast<double>()),
                1e-6);
      Eigen::Matrix<float, 1, kJoints> weights = Eigen::Matrix<float, 1, kJoints>::Zero();
      for (const json& pair : expected.at("weights").at(i))
        weights[pair.at(0).get<int>()] = pair.at(1);
      EXPECT_LT((body.weights.row(static_cast<Eigen::Index>(v)) - weights).cwiseAbs().maxCoeff(),
                1e-6f);
    }
    for (int j = 0; j < kJoints; ++j)
      EXPECT_LT(difference(expected.at("joints").at(static_cast<size_t>(j)), body.joints[j]), 1e-6);
    const json& faces = expected.at("triangles");
    EXPECT_EQ(body.rest.faces.front(), faces.at(1).get<Triangle>());
    EXPECT_EQ(body.rest.faces[5000], faces.at(2).get<Triangle>());
    EXPECT_EQ(body.rest.faces.back(), faces.at(3).get<Triangle>());
  }
}

TEST(ImportersMakeHuman, EveryBodyIsAStandingTPose) {
  RESTAGE_NEED_DATA();
  const MakeHuman model(body_folder());
  std::set<std::string> splits;
  const std::vector<BodyRecipe> recipes = read_recipes(body_folder() + "/bodies.csv");
  for (size_t i = 0; i < recipes.size(); i += 20) {
    const Body body = model.build(recipes[i]);
    splits.insert(body.split);
    float low = 1, high = 0;
    for (const Point& v : body.rest.vertices) {
      low = std::min(low, v.y());
      high = std::max(high, v.y());
    }
    EXPECT_NEAR(low, 0, 1e-6);
    EXPECT_GT(high, 1.4);
    EXPECT_LT(high, 2.1);
    EXPECT_NEAR(body.joints[18].y(), body.joints[16].y(), 1e-9);  // arms on a line along +x
    EXPECT_NEAR(body.joints[20].z(), body.joints[16].z(), 1e-9);
    EXPECT_GT(body.joints[20].x(), body.joints[16].x() + 0.3);
    EXPECT_NEAR(body.weights.rowwise().sum().minCoeff(), 1, 1e-5);
    EXPECT_NEAR(body.weights.rowwise().sum().maxCoeff(), 1, 1e-5);
  }
}

TEST(ImportersMakeHuman, GarmentsFitTheBody) {
  RESTAGE_NEED_DATA();
  const MakeHuman model(body_folder());
  const BodyRecipe recipe = read_recipes(body_folder() + "/bodies.csv").at(0);
  const json expected = golden().at("garment");
  const Body dressed = model.build(recipe, expected.at("name"));
  ASSERT_EQ(dressed.rest.vertices.size(), expected.at("count").get<size_t>());
  ASSERT_EQ(dressed.rest.faces.size(), expected.at("triangles").get<size_t>());
  for (size_t i = 0; i < expected.at("pick").size(); ++i) {
    const size_t v = expected.at("pick").at(i);
    EXPECT_LT(difference(expected.at("vertices").at(i), dressed.rest.vertices[v].cast<double>()),
              1e-6);
  }
  EXPECT_THROW(model.build(recipe, "toga"), InputError);
  EXPECT_THROW(model.build(recipe, "../bodies"), InputError);
}

class ImportersRecipes : public ::testing::Test {
 protected:
  void SetUp() override { path_ = ::testing::TempDir() + "importers_recipes.csv"; }
  void TearDown() override { fs::remove(path_); }
  std::vector<BodyRecipe> read(const std::string& text) {
    std::ofstream(path_) << text;
    return read_recipes(path_);
  }
  std::string path_;
  const std::string header_ =
      "id,split,gender,age,muscle,weight,height,proportions,african,asian,caucasian,hip/"
      "hip-scale\n";
};

TEST_F(ImportersRecipes, RowsBecomeTargetWeights) {
  const auto recipes = read(
      header_ + "a,train,1,.5,.5,.5,.5,.5,0,0,1,-.25\r\n\nb,test,0,0.1,1,0,0.75,1,.5,.5,1,0\n");
  ASSERT_EQ(recipes.size(), 2u);
  EXPECT_EQ(recipes[1].id, "b");
  const TargetWeights a = recipe_targets(recipes[0]);
  EXPECT_DOUBLE_EQ(a.at("hip/hip-scale-decr"), 0.25);
  EXPECT_DOUBLE_EQ(a.at("macrodetails/caucasian-male-young"), 1);
  EXPECT_DOUBLE_EQ(a.at("macrodetails/universal-male-young-averagemuscle-averageweight"), 1);
  const TargetWeights b = recipe_targets(recipes[1]);
  EXPECT_NEAR(b.at("macrodetails/asian-female-child"), 0.25 * 0.1 / 0.1875, 1e-12);
  EXPECT_NEAR(b.at("macrodetails/height/female-child-maxmuscle-minweight-maxheight"),
              0.5 * 0.1 / 0.1875, 1e-12);
}

TEST_F(ImportersRecipes, BadRowsAreNamed) {
  const std::string good = "a,train,1,.5,.5,.5,.5,.5,0,0,1,0\n";
  for (const std::string& bad :
       {std::string("a,train,1\n"), std::string("a,train,2,.5,.5,.5,.5,.5,0,0,1,0\n"),
        std::string("a,train,x,.5,.5,.5,.5,.5,0,0,1,0\n"),
        std::string("a,train,nan,.5,.5,.5,.5,.5,0,0,1,0\n"),
        std::string("a,other,1,.5,.5,.5,.5,.5,0,0,1,0\n"),
        std::string(",train,1,.5,.5,.5,.5,.5,0,0,1,0\n"),
        std::string("a,train,1,.5,.5,.5,.5,.5,0,0,0,0\n"), good + good}) {
    try {
      read(header_ + bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("importers_recipes.csv:"), std::string::npos)
          << error.what();
    }
  }
  EXPECT_THROW(read(""), InputError);
  EXPECT_THROW(read(header_), InputError);
  EXPECT_THROW(read("id,split\na,train\n"), InputError);
}

TEST(ImportersMakeHumanBad, MissingModelIsAnInputError) {
  EXPECT_THROW(MakeHuman("/no/such/folder"), InputError);
}

}  // namespace
}  // namespace restage
