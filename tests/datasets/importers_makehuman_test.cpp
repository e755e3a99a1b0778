// MakeHuman bodies against the data folder's reference tool (tests/golden/bodies.json), and against
// the same body as an exporter writes it (A-pose, 53 bones, their own weights). Anny's bodies are
// of this model.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "datasets/hdf5/file.h"
#include "datasets/importers/bodies/makehuman.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/support/data_folder.h"
#include "tests/support/files.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using ImportersGltfMakeHuman = FileTest;

std::string body_folder() { return data_folder() + "/body"; }

json golden() { return json::parse(bytes_of(RESTAGE_SOURCE_DIR "/tests/golden/bodies.json")); }

double difference(const json& expected, const Vec3& value) {
  return (Vec3(expected.at(0), expected.at(1), expected.at(2)) - value).norm();
}

/// The vertices that the reference tool picked are where it has them.
void expect_picked(const json& expected, const Body& body) {
  for (size_t i = 0; i < expected.at("pick").size(); ++i) {
    const size_t v = expected.at("pick").at(i);
    EXPECT_LT(difference(expected.at("vertices").at(i), body.rest.vertices[v].cast<double>()),
              1e-6);
  }
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
    expect_picked(expected, body);
    for (size_t i = 0; i < expected.at("pick").size(); ++i) {
      const size_t v = expected.at("pick").at(i);
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
  expect_picked(expected, dressed);
  EXPECT_THROW(model.build(recipe, "toga"), InputError);
  EXPECT_THROW(model.build(recipe, "../bodies"), InputError);
}

class ImportersRecipes : public FileTest {
 protected:
  std::vector<BodyRecipe> read(const std::string& text) {
    return read_recipes(dir.write("recipes.csv", text));
  }
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
        std::string("a,train,1,.5,.5,.5,.5,.5,0,0,0,0\n"), good + good})
    EXPECT_HAS(error_of([&] { read(header_ + bad); }), "recipes.csv:");
  EXPECT_THROW(read(""), InputError);
  EXPECT_THROW(read(header_), InputError);
  EXPECT_THROW(read("id,split\na,train\n"), InputError);
}

TEST(ImportersMakeHumanBad, MissingModelIsAnInputError) {
  EXPECT_THROW(MakeHuman("/no/such/folder"), InputError);
}

// ---- as an exporter writes it

/// The data of makehuman.h5 in decimetres, shaped by a recipe.
struct Model {
  std::vector<Vec3> vertices;
  std::vector<int32_t> quads, parents;
  std::vector<std::string> names;
  std::vector<Vec3> heads;
  std::vector<std::vector<std::pair<int, float>>> weights;  ///< per vertex: bone, weight
};

Model read_model(const std::string& path, const BodyRecipe& recipe) {
  const h5::File file = h5::File::open(path);
  Model out;
  const auto xyz = file.read<double>("/base/vertices", {-1, 3});
  for (size_t i = 0; i < xyz.size(); i += 3)
    out.vertices.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
  const auto targets = file.dataset("/targets/names").read_text();
  const auto start = file.read<int64_t>("/targets/start", {-1});
  const auto count = file.read<int64_t>("/targets/count", {-1});
  const auto index = file.read<int32_t>("/targets/index", {-1});
  const auto delta = file.read<int16_t>("/targets/delta_milli", {-1, 3});
  const TargetWeights shape = recipe_targets(recipe);
  for (size_t t = 0; t < targets.size(); ++t) {
    const auto weight = shape.find(targets[t]);
    if (weight == shape.end()) continue;
    for (auto i = static_cast<size_t>(start[t]); i < static_cast<size_t>(start[t] + count[t]); ++i)
      out.vertices[static_cast<size_t>(index[i])] +=
          weight->second / 1000 * Vec3(delta[3 * i], delta[3 * i + 1], delta[3 * i + 2]);
  }
  out.quads = file.read<int32_t>("/base/body_quads", {-1, 4});
  out.names = file.dataset("/rig/bone_names").read_text();
  out.parents = file.read<int32_t>("/rig/bone_parent", {-1});
  const h5::Dataset heads = file.dataset("/rig/head_vertices", {-1, -1});
  const auto head = heads.read<int32_t>();
  const auto width = static_cast<size_t>(heads.row_size());
  for (size_t b = 0; b < out.names.size(); ++b) {
    Vec3 sum = Vec3::Zero();
    int n = 0;
    for (size_t k = 0; k < width; ++k)
      if (const int32_t v = head[b * width + k]; v >= 0)
        sum += out.vertices[static_cast<size_t>(v)], ++n;
    out.heads.push_back(sum / std::max(n, 1));
  }
  const auto bone = file.read<int32_t>("/rig/weight_bone", {-1});
  const auto vertex = file.read<int32_t>("/rig/weight_vertex", {-1});
  const auto value = file.read<double>("/rig/weight_value", {-1});
  out.weights.resize(out.vertices.size());
  for (size_t i = 0; i < value.size(); ++i)
    if (value[i] > 0)
      out.weights[static_cast<size_t>(vertex[i])].emplace_back(bone[i],
                                                               static_cast<float>(value[i]));
  return out;
}

/// As MakeHuman's and Anny's exporters do it: metres, y up, the skin in its A-pose, two sets of
/// four joints a vertex.
testing::GlbParts export_model(const Model& model, size_t skin) {
  testing::GlbParts out;
  std::vector<float> positions, inverse, weights[2];
  std::vector<uint8_t> joints[2];
  for (size_t v = 0; v < skin; ++v) {
    for (int c = 0; c < 3; ++c) positions.push_back(static_cast<float>(model.vertices[v][c] / 10));
    EXPECT_LE(model.weights[v].size(), 8u);
    for (size_t k = 0; k < 8; ++k) {
      const bool has = k < model.weights[v].size();
      joints[k / 4].push_back(static_cast<uint8_t>(has ? model.weights[v][k].first : 0));
      weights[k / 4].push_back(has ? model.weights[v][k].second : 0.0f);
    }
  }
  std::vector<int> list;
  for (size_t b = 0; b < model.names.size(); ++b) {
    const int p = model.parents[b];
    const Vec3 offset =
        (model.heads[b] - (p < 0 ? Vec3(Vec3::Zero()) : model.heads[static_cast<size_t>(p)])) / 10;
    testing::GltfJson& node = out.root["nodes"][b];  // parents need not come first
    node["name"] = model.names[b];
    node["translation"] = {offset.x(), offset.y(), offset.z()};
    if (p >= 0) out.root["nodes"][static_cast<size_t>(p)]["children"].push_back(b);
    Eigen::Affine3d bind = Eigen::Affine3d::Identity();
    bind.translation() = -model.heads[b] / 10;
    for (const float x : testing::as_floats(bind.matrix())) inverse.push_back(x);
    list.push_back(static_cast<int>(b));
  }
  std::vector<uint32_t> index;
  for (const auto& corners : {std::array<size_t, 3>{0, 1, 2}, std::array<size_t, 3>{0, 2, 3}})
    for (size_t q = 0; q < model.quads.size(); q += 4)
      for (const size_t c : corners) index.push_back(static_cast<uint32_t>(model.quads[q + c]));
  testing::GltfJson primitive;
  primitive["attributes"] = {{"POSITION", out.floats(positions, "VEC3", 3)},
                             {"JOINTS_0", out.add(joints[0], 5121, "VEC4", 4)},
                             {"WEIGHTS_0", out.floats(weights[0], "VEC4", 4)},
                             {"JOINTS_1", out.add(joints[1], 5121, "VEC4", 4)},
                             {"WEIGHTS_1", out.floats(weights[1], "VEC4", 4)}};
  primitive["indices"] = out.add(index, 5125, "SCALAR", 1);
  out.root["meshes"] = {{{"primitives", {primitive}}}};
  out.root["skins"] = {
      {{"joints", list}, {"inverseBindMatrices", out.floats(inverse, "MAT4", 16)}}};
  out.root["nodes"].push_back({{"name", "Human"}, {"mesh", 0}, {"skin", 0}});
  return out;
}

TEST_F(ImportersGltfMakeHuman, ExportedBodyEqualsTheBuiltOne) {
  RESTAGE_NEED_DATA();
  const std::string h5 = body_folder() + "/makehuman.h5";
  const BodyRecipe recipe = read_recipes(body_folder() + "/bodies.csv").at(3);
  const Body built = MakeHuman(body_folder()).build(recipe);
  const std::string path = dir.write(
      "makehuman.glb", export_model(read_model(h5, recipe), built.rest.vertices.size()).glb());
  if (const char* keep = std::getenv("RESTAGE_KEEP"))
    fs::copy_file(path, fs::path(keep) / "makehuman.glb", fs::copy_options::overwrite_existing);
  const Character found = read_character(path);
  ASSERT_TRUE(found.body);
  EXPECT_EQ(found.body->rest.faces, built.rest.faces);
  ASSERT_EQ(found.body->rest.vertices.size(), built.rest.vertices.size());
  const Vec3 shift(built.joints[0].x(), 0, built.joints[0].z());  // ours stands over the origin
  double worst = 0, joint = 0;
  for (size_t v = 0; v < built.rest.vertices.size(); ++v)
    worst = std::max(worst, (found.body->rest.vertices[v].cast<double>() + shift -
                             built.rest.vertices[v].cast<double>())
                                .norm());
  for (int j = 0; j < kJoints; ++j)
    joint = std::max(joint, (found.body->joints[j] + shift - built.joints[j]).norm());
  EXPECT_LT(worst, 1e-4);
  EXPECT_LT(joint, 1e-4);
  EXPECT_LT((found.body->weights - built.weights).cwiseAbs().maxCoeff(), 1e-5f);
}

}  // namespace
}  // namespace restage
