// The MakeHuman body as an exporter writes it (A-pose, 53 bones, their own weights) against the
// same body as our importer builds it. Anny's bodies are of this model.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/importers/makehuman.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/support/data_folder.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

std::string body_folder() { return test::data_folder() + "/body"; }

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
  std::vector<float> positions, inverse;
  std::vector<uint8_t> joints[2];
  std::vector<float> weights[2];
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

TEST(ImportersGltfMakeHuman, ExportedBodyEqualsTheBuiltOne) {
  RESTAGE_NEED_DATA();
  const std::string h5 = body_folder() + "/makehuman.h5";
  const BodyRecipe recipe = read_recipes(body_folder() + "/bodies.csv").at(3);
  const Body built = MakeHuman(body_folder()).build(recipe);
  const std::string path = ::testing::TempDir() + "importers_gltf_makehuman.glb";
  write_file_atomically(path,
                        export_model(read_model(h5, recipe), built.rest.vertices.size()).glb());
  if (const char* keep = std::getenv("RESTAGE_KEEP"))
    fs::copy_file(path, fs::path(keep) / "makehuman.glb", fs::copy_options::overwrite_existing);
  const Character found = read_character(path);
  fs::remove(path);
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
