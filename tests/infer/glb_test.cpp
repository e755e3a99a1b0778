#include "infer/writers/glb.h"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cstring>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "tests/infer/toy_body.h"

namespace restage {
namespace {

using testing::toy_body;
using testing::toy_pose;
using testing::toy_surface;

class GlbWriterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("restage_glb_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  // Twenty frames of the walk; RESTAGE_KEEP=FOLDER keeps the files for the validator.
  InfluenceError write(const std::string& name, const Body& body, int frames = 20) {
    GlbWriter writer(path(name), body.rest, body.joints, body.weights);
    for (int f = 0; f < frames; ++f) writer.push(toy_pose(body, f / 20.0));
    const InfluenceError error = writer.commit();
    if (const char* keep = std::getenv("RESTAGE_KEEP"))
      std::filesystem::copy_file(path(name), std::filesystem::path(keep) / name,
                                 std::filesystem::copy_options::overwrite_existing);
    return error;
  }
  tinygltf::Model load(const std::string& name) {
    tinygltf::TinyGLTF loader;
    tinygltf::Model model;
    std::string problem, warning;
    EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &problem, &warning, path(name))) << problem;
    EXPECT_EQ(problem + warning, "");
    return model;
  }
  template <class T>
  std::vector<T> values(const tinygltf::Model& model, int accessor) {
    const auto& a = model.accessors.at(accessor);
    const auto& view = model.bufferViews.at(a.bufferView);
    const size_t count = a.count * tinygltf::GetNumComponentsInType(a.type);
    EXPECT_EQ(tinygltf::GetComponentSizeInBytes(a.componentType), static_cast<int>(sizeof(T)));
    std::vector<T> out(count);
    std::memcpy(out.data(), model.buffers.at(view.buffer).data.data() + view.byteOffset,
                count * sizeof(T));
    return out;
  }

  std::filesystem::path folder_;
};

TEST_F(GlbWriterTest, HoldsSkeletonSkinAndAnimation) {
  const Body body = toy_body();
  write("walk.glb", body);
  const auto model = load("walk.glb");
  ASSERT_EQ(model.skins.size(), 1u);
  ASSERT_EQ(model.skins[0].joints.size(), 22u);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_EQ(model.nodes[model.skins[0].joints[j]].name, kJointNames[j]);
  const auto& primitive = model.meshes.at(0).primitives.at(0);
  EXPECT_EQ(primitive.mode, TINYGLTF_MODE_TRIANGLES);
  EXPECT_EQ(model.accessors[primitive.indices].count, 3 * body.rest.faces.size());
  for (const char* name : {"POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0"})
    EXPECT_EQ(model.accessors[primitive.attributes.at(name)].count, body.rest.vertices.size())
        << name;
  ASSERT_EQ(model.animations.size(), 1u);
  EXPECT_EQ(model.animations[0].channels.size(), 23u);
  const auto times = values<float>(model, model.animations[0].samplers[0].input);
  ASSERT_EQ(times.size(), 20u);
  EXPECT_FLOAT_EQ(times.back(), 19.0f / 30.0f);
  const auto bounds = model.accessors[model.animations[0].samplers[0].input].maxValues;
  EXPECT_FLOAT_EQ(static_cast<float>(bounds.at(0)), times.back());
}

TEST_F(GlbWriterTest, WeightsSumToOneAndTurnsAreUnitAndContinuous) {
  write("walk.glb", toy_body(), 60);  // three turns and more of the root: q changes hemisphere
  const auto model = load("walk.glb");
  const auto weights =
      values<float>(model, model.meshes[0].primitives[0].attributes.at("WEIGHTS_0"));
  for (size_t v = 0; v < weights.size(); v += 4)
    ASSERT_NEAR(double{weights[v]} + weights[v + 1] + weights[v + 2] + weights[v + 3], 1.0, 1.2e-7);
  for (const auto& channel : model.animations[0].channels) {
    if (channel.target_path != "rotation") continue;
    const auto q = values<float>(model, model.animations[0].samplers[channel.sampler].output);
    for (size_t k = 0; k < q.size(); k += 4) {
      const Eigen::Map<const Eigen::Vector4f> now(&q[k]);
      ASSERT_NEAR(now.norm(), 1, 1e-6);
      if (k > 0) {
        ASSERT_GT(now.dot(Eigen::Map<const Eigen::Vector4f>(&q[k - 4])), 0);
      }
    }
  }
}

// Poses the file as a viewer does and compares with blending of all 22 weights.
TEST_F(GlbWriterTest, PosedByItsOwnDataStaysWithinTheReportedError) {
  const Body body = toy_body();
  const InfluenceError error = write("walk.glb", body);
  EXPECT_GT(error.max, 1e-4);  // toy weights of all joints: something is lost
  EXPECT_GE(error.max, error.p95);
  EXPECT_GE(error.p95, error.mean);
  const auto model = load("walk.glb");
  const auto& attributes = model.meshes[0].primitives[0].attributes;
  const auto rest = values<float>(model, attributes.at("POSITION"));
  const auto weights = values<float>(model, attributes.at("WEIGHTS_0"));
  const auto joints = values<uint8_t>(model, attributes.at("JOINTS_0"));
  const auto inverse = values<float>(model, model.skins[0].inverseBindMatrices);
  double largest = 0;
  for (const int frame : {0, 7, 19}) {
    std::vector<Eigen::Matrix4f> world(kJoints);
    std::vector<Eigen::Vector3f> moved(kJoints);
    for (int j = 0; j < kJoints; ++j)
      moved[j] = Eigen::Map<const Eigen::Vector3d>(model.nodes[j].translation.data()).cast<float>();
    std::vector<Eigen::Matrix3f> turned(kJoints, Eigen::Matrix3f::Identity());
    for (const auto& channel : model.animations[0].channels) {
      const auto out = values<float>(model, model.animations[0].samplers[channel.sampler].output);
      if (channel.target_path == "translation")
        moved[channel.target_node] = Eigen::Map<const Eigen::Vector3f>(&out[3 * frame]);
      else
        turned[channel.target_node] = Eigen::Quaternionf(&out[4 * frame]).toRotationMatrix();
    }
    for (int j = 0; j < kJoints; ++j) {
      Eigen::Matrix4f local = Eigen::Matrix4f::Identity();
      local.topLeftCorner<3, 3>() = turned[j];
      local.topRightCorner<3, 1>() = moved[j];
      world[j] = j == 0 ? local : Eigen::Matrix4f(world[kParents[j]] * local);
    }
    const Points truth = toy_surface(body, toy_pose(body, frame / 20.0));
    for (size_t v = 0; v < truth.size(); ++v) {
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      for (size_t k = 4 * v; k < 4 * v + 4; ++k)
        sum += weights[k] * (world[joints[k]] *
                             (Eigen::Map<const Eigen::Matrix4f>(&inverse[16 * joints[k]]) *
                              Eigen::Vector4f(rest[3 * v], rest[3 * v + 1], rest[3 * v + 2], 1)));
      largest = std::max(largest, double{(sum.head<3>() - truth[v]).norm()});
    }
  }
  EXPECT_LE(largest, error.max + 1e-5);
  EXPECT_GT(largest, 0.3 * error.max);
}

TEST_F(GlbWriterTest, FourInfluencesLoseNothing) {
  Body body = toy_body();
  for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
    const Influences kept = strongest_four(body.weights.row(v));
    body.weights.row(v).setZero();
    for (int k = 0; k < 4; ++k) body.weights(v, kept.joints[0][k]) += kept.weights[0][k];
  }
  EXPECT_LT(write("four.glb", body).max, 1e-6);
}

TEST_F(GlbWriterTest, SameInputSameBytes) {
  write("a.glb", toy_body());
  write("b.glb", toy_body());
  EXPECT_EQ(read_file(path("a.glb")), read_file(path("b.glb")));
}

TEST_F(GlbWriterTest, CloudBecomesPointsAndNoFramesNoAnimation) {
  Body body = toy_body();
  body.rest.faces.clear();
  write("cloud.glb", body, 5);
  EXPECT_EQ(load("cloud.glb").meshes[0].primitives[0].mode, TINYGLTF_MODE_POINTS);
  write("still.glb", body, 0);
  EXPECT_TRUE(load("still.glb").animations.empty());
  write("one.glb", body, 1);
  EXPECT_EQ(load("one.glb").animations.size(), 1u);
}

TEST_F(GlbWriterTest, BadInputLeavesNothing) {
  Body body = toy_body();
  body.weights(3, 0) = NAN;
  EXPECT_THROW(GlbWriter(path("x.glb"), body.rest, body.joints, body.weights), InputError);
  body = toy_body();
  body.rest.faces[0][1] = 1 << 30;
  EXPECT_THROW(GlbWriter(path("x.glb"), body.rest, body.joints, body.weights), InputError);
  body = toy_body();
  EXPECT_THROW(GlbWriter(path("x.glb"), body.rest, body.joints, body.weights.topRows(5)),
               ShapeError);
  EXPECT_THROW(GlbWriter(path("x.glb"), Mesh{}, body.joints, body.weights.topRows(0)), InputError);
  GlbWriter writer(path("x.glb"), body.rest, body.joints, body.weights);
  Pose pose = toy_pose(body, 0);
  pose.root.x() = INFINITY;
  EXPECT_THROW(writer.push(pose), WorkError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST(GlbInfluences, RowsOfAnySharpness) {
  SkinWeights weights(3, kJoints);
  weights.setConstant(1.0f / kJoints);  // ties: the lower joints
  weights.row(1).setZero();
  weights(1, 21) = 1;  // one joint
  weights.row(2).setConstant(1e-9f);
  weights(2, 4) = 0.75f, weights(2, 9) = 0.25f;
  const Influences cut = strongest_four(weights);
  EXPECT_EQ(cut.joints[0], (std::array<uint8_t, 4>{0, 1, 2, 3}));
  EXPECT_EQ(cut.joints[1], (std::array<uint8_t, 4>{21, 0, 0, 0}));
  EXPECT_EQ(cut.weights[1], (std::array<float, 4>{1, 0, 0, 0}));
  EXPECT_EQ(cut.joints[2], (std::array<uint8_t, 4>{4, 9, 0, 0}));
}

}  // namespace
}  // namespace restage
