// What is written of a result: GLB, BVH, PLY and OBJ frames.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "autograd/base/error.h"
#include "datasets/frame_writer.h"
#include "datasets/readers/skeletons/bvh.h"
#include "infer/writers/bvh.h"
#include "infer/writers/glb.h"
#include "tests/infer/toy_body.h"
#include "tests/support/files.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::toy_body;
using testing::toy_pose;
using WritersTest = FileTest;

class GlbWriterTest : public FileTest {
 protected:
  // Twenty frames of the walk; RESTAGE_KEEP=FOLDER keeps the files for the validator.
  InfluenceError write(const std::string& name, const Body& body, int frames = 20) {
    GlbWriter writer(dir / name, body.rest, body.joints, body.weights);
    for (int f = 0; f < frames; ++f) writer.push(toy_pose(body, f / 20.0));
    const InfluenceError error = writer.commit();
    if (const char* keep = std::getenv("RESTAGE_KEEP"))
      fs::copy_file(dir / name, fs::path(keep) / name, fs::copy_options::overwrite_existing);
    return error;
  }
  tinygltf::Model load(const std::string& name) {
    tinygltf::TinyGLTF loader;
    tinygltf::Model model;
    std::string problem, warning;
    EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &problem, &warning, dir / name)) << problem;
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
    const Points truth = linear_blend_skinning(body, toy_pose(body, frame / 20.0));
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
  EXPECT_EQ(bytes_of(dir / "a.glb"), bytes_of(dir / "b.glb"));
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
  const Body body = toy_body();
  SkinWeights nan = body.weights;
  nan(3, 0) = NAN;
  Mesh outside = body.rest;
  outside.faces[0][1] = 1 << 30;
  const auto open = [&](const Mesh& rest, const SkinWeights& weights) {
    GlbWriter(dir / "x.glb", rest, body.joints, weights);
  };
  EXPECT_THROW(open(body.rest, nan), InputError);
  EXPECT_THROW(open(outside, body.weights), InputError);
  EXPECT_THROW(open(body.rest, body.weights.topRows(5)), ShapeError);
  EXPECT_THROW(open(Mesh{}, body.weights.topRows(0)), InputError);
  GlbWriter writer(dir / "x.glb", body.rest, body.joints, body.weights);
  Pose pose = toy_pose(body, 0);
  pose.root.x() = INFINITY;
  EXPECT_THROW(writer.push(pose), WorkError);
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

TEST_F(GlbWriterTest, MorphTargetsAreBytesWithWeightsOverTime) {
  const Body body = toy_body();
  GlbWriter writer(dir / "morphs.glb", body.rest, body.joints, body.weights);
  for (int f = 0; f < 3; ++f) writer.push(toy_pose(body, f / 20.0));
  const size_t vertices = body.rest.vertices.size();
  GlbMorphs morphs;
  for (const int size : {1, 2}) {
    morphs.deltas.emplace_back();
    for (size_t i = 0; i < 3 * vertices; ++i)
      morphs.deltas.back().push_back(static_cast<int8_t>(static_cast<int>(i) * size % 255 - 127));
  }
  morphs.weights = {0.1f, 0.2f, 0.3f, -0.4f, 0.5f, 0};
  morphs.distance = {0.001, -1, 0.002};
  GlbMorphs short_ones = morphs;
  short_ones.weights.pop_back();
  EXPECT_THROW(writer.set_morphs(short_ones), ShapeError);
  short_ones = morphs;
  short_ones.deltas[0].pop_back();
  EXPECT_THROW(writer.set_morphs(short_ones), ShapeError);
  writer.set_morphs(morphs);
  writer.commit();
  const auto model = load("morphs.glb");
  EXPECT_EQ(model.extensionsRequired, std::vector<std::string>{"KHR_mesh_quantization"});
  const auto& targets = model.meshes.at(0).primitives.at(0).targets;
  ASSERT_EQ(targets.size(), 2u);
  for (size_t k = 0; k < 2; ++k) {
    const auto& a = model.accessors.at(targets[k].at("POSITION"));
    EXPECT_TRUE(a.normalized);
    ASSERT_EQ(a.count, vertices);
    const auto& view = model.bufferViews.at(a.bufferView);
    const auto* bytes = model.buffers.at(0).data.data() + view.byteOffset;
    for (size_t i = 0; i < 3 * vertices; ++i)
      ASSERT_EQ(static_cast<int8_t>(bytes[view.byteStride * (i / 3) + i % 3]), morphs.deltas[k][i]);
  }
  const auto& animation = model.animations.at(0);
  const auto& last = animation.channels.back();
  EXPECT_EQ(last.target_path, "weights");
  EXPECT_EQ(model.nodes.at(last.target_node).mesh, 0);
  const int output = animation.samplers.at(last.sampler).output;
  EXPECT_TRUE(model.accessors.at(output).normalized);
  const auto shorts = values<int16_t>(model, output);
  ASSERT_EQ(shorts.size(), morphs.weights.size());
  for (size_t i = 0; i < shorts.size(); ++i)
    EXPECT_EQ(shorts[i], std::lround(32767 * morphs.weights[i]));
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

// ---- BVH and frames
// --------------------------------------------------------------------------------

TEST_F(WritersTest, BvhPosesTheSameJoints) {
  const Body body = toy_body();
  BvhWriter writer(dir / "walk.bvh", body.joints);
  for (int f = 0; f < 12; ++f) writer.push(toy_pose(body, f / 12.0));
  EXPECT_FALSE(fs::exists(dir / "walk.bvh"));
  writer.commit();
  const BvhFile bvh = parse_bvh(bytes_of(dir / "walk.bvh"), "walk.bvh");
  ASSERT_EQ(bvh.skeleton.size(), 22u);
  ASSERT_EQ(bvh.channel_count, 69u);
  ASSERT_EQ(bvh.frames.size(), 12u);
  EXPECT_DOUBLE_EQ(bvh.frame_time, 1.0 / 30.0);
  for (size_t f = 0; f < 12; ++f) {
    const std::vector<double>& row = bvh.frames[f];
    const PosedSkeleton truth =
        forward_kinematics(body.joints, toy_pose(body, static_cast<double>(f) / 12));
    std::vector<Vec3> at(22);
    std::vector<Quat> turned(22);
    for (size_t i = 0; i < 22; ++i) {
      const auto p = static_cast<size_t>(std::max(bvh.skeleton.parents[i], 0));
      turned[i] = i == 0 ? Quat::Identity() : turned[p];
      at[i] =
          i == 0 ? Vec3(row[0], row[1], row[2]) : Vec3(at[p] + turned[p] * bvh.skeleton.offsets[i]);
      for (size_t k = i == 0 ? 3 : 0; k < bvh.channels[i].size(); ++k)
        turned[i] = turned[i] * channel_rotation(bvh.channels[i][k], row[bvh.first_channel[i] + k]);
      const std::string& name = bvh.skeleton.names[i];
      const auto joint = std::find(kJointNames.begin(), kJointNames.end(), name);
      ASSERT_NE(joint, kJointNames.end()) << name;
      const Vec3& wanted = truth.joints[static_cast<size_t>(joint - kJointNames.begin())];
      EXPECT_LT((at[i] / 100 - wanted).norm(), 1e-6) << name;
    }
    for (size_t k = 3; f > 0 && k < row.size(); ++k)
      EXPECT_LT(std::abs(row[k] - bvh.frames[f - 1][k]), 120) << "channel " << k;
  }
}

TEST(BvhAngles, EveryRotationComesBack) {
  const Vec3 before(3, -7, 20);
  for (const double y : {-90.0, -89.9999999, -40.0, 0.0, 90.0, 130.0})
    for (const double z : {-170.0, 0.0, 45.0})
      for (const double x : {-100.0, 0.0, 179.0}) {
        const auto matrix = [](const Vec3& a) {
          return Mat3(Eigen::AngleAxisd(a[0], Vec3::UnitZ()) *
                      Eigen::AngleAxisd(a[1], Vec3::UnitY()) *
                      Eigen::AngleAxisd(a[2], Vec3::UnitX()));
        };
        const Mat3 r = matrix(Vec3(z, y, x) * std::numbers::pi / 180);
        EXPECT_LT((matrix(euler_zyx(r, before)) - r).norm(), 1e-6) << z << ' ' << y << ' ' << x;
      }
}

TEST_F(WritersTest, BvhLeavesNothingWithoutCommit) {
  const Body body = toy_body();
  {
    BvhWriter writer(dir / "x.bvh", body.joints);
    Pose pose = toy_pose(body, 0);
    pose.local[4](0, 0) = NAN;
    EXPECT_THROW(writer.push(pose), WorkError);
  }
  EXPECT_EQ(names_in(dir.path()).size(), 0u);
  EXPECT_THROW(BvhWriter(dir / "no/such/x.bvh", body.joints), InputError);
}

TEST_F(WritersTest, FoldersAppearWhole) {
  const Body body = toy_body();
  {
    FrameFolderWriter writer(dir / "out/", body.rest.faces);
    writer.push(body.rest.vertices);
    EXPECT_FALSE(fs::exists(dir / "out"));
  }
  EXPECT_EQ(names_in(dir.path()).size(), 0u);
  for (const size_t frames : {3, 2}) {  // the second time over the first
    FrameFolderWriter writer(dir / "out", body.rest.faces);
    for (size_t f = 0; f < frames; ++f) writer.push(body.rest.vertices);
    writer.commit();
    EXPECT_EQ(names_in(dir.path()).size(), 1u);
    EXPECT_TRUE(fs::exists(dir / "out/frame_000001.ply"));
    EXPECT_EQ(fs::exists(dir / "out/frame_000002.ply"), frames == 3);
  }
}

TEST_F(WritersTest, FoldersWithOtherFilesAreKept) {
  dir.write("mine/thesis.txt", "precious");
  EXPECT_THROW(FrameFolderWriter(dir / "mine", {}), InputError);
  dir.write("file", "x");
  EXPECT_THROW(FrameFolderWriter(dir / "file", {}), InputError);
  EXPECT_THROW(FrameFolderWriter(dir / "no/such/folder", {}), InputError);
  EXPECT_TRUE(fs::exists(dir / "mine/thesis.txt"));
  EXPECT_EQ(names_in(dir.path()).size(), 2u);
}

/// Scanners and other programs name their frames as we do.
TEST_F(WritersTest, FramesOfOthersAreKept) {
  const std::string theirs = ply_bytes({{1, 2, 3}}, {}, false);
  for (const std::string name : {"frame_000001.ply", "frame_000001.obj", "frame_0000001.ply"}) {
    fs::remove_all(dir / "out");
    FrameFolderWriter early(dir / "out", {});
    early.push({{1, 2, 3}});
    early.push({{1, 2, 3}});
    early.commit();
    dir.write("out/" + name, theirs);
    const std::string said = refusal_of([&] { FrameFolderWriter(dir / "out", {}); });
    EXPECT_HAS(said, name);
    EXPECT_HAS(said, "did not write");
    EXPECT_EQ(bytes_of(dir / ("out/" + name)), theirs);
  }
  // Nor what comes into the folder while the frames are written.
  fs::remove_all(dir / "out");
  FrameFolderWriter late(dir / "out", {});
  late.push({{1, 2, 3}});
  dir.write("out/frame_000000.ply", theirs);
  EXPECT_THROW(late.commit(), InputError);
  EXPECT_EQ(bytes_of(dir / "out/frame_000000.ply"), theirs);
  // A link is somebody's decision, whatever it leads to.
  fs::remove_all(dir / "out");
  fs::create_directory(dir / "out");
  dir.write("elsewhere.obj", obj_bytes({{1, 2, 3}}, {}));
  fs::create_symlink("../elsewhere.obj", dir / "out/frame_000000.obj");
  EXPECT_THROW(FrameFolderWriter(dir / "out", {}), InputError);
}

TEST_F(WritersTest, CloudsMayChangeTheirCountAndBadFramesAreRefused) {
  FrameFolderWriter writer(dir / "clouds", {}, MeshFormat::obj);
  writer.push({{0, 0, 0}, {1, 2, 3}});
  writer.push({{0.1f, 0, 0}});
  writer.push({});  // shows nothing
  EXPECT_THROW(writer.push({}, {{0, 1, 2}}), InputError);
  EXPECT_THROW(writer.push({{NAN, 0, 0}}), InputError);
  writer.commit();
  EXPECT_EQ(bytes_of(dir / "clouds/frame_000000.obj"),
            "# restage, metres, y up\nv 0 0 0\nv 1 2 3\n");
  EXPECT_EQ(bytes_of(dir / "clouds/frame_000002.obj"), "# restage, metres, y up\n");
  EXPECT_EQ(bytes_of(dir / "clouds/frame_000001.obj"),
            "# restage, metres, y up\nv 0.100000001 0 0\n");
}

TEST(MeshFile, PlyBytesAreWhatTheHeaderSays) {
  const std::string bytes = ply_bytes({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, {{0, 1, 2}});
  const size_t body = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size(), body + 3 * 12 + 13);
  EXPECT_HAS(bytes, "element vertex 3\n");
  EXPECT_HAS(bytes, "element face 1\n");
  float x = 0;
  std::memcpy(&x, bytes.data() + body + 12, 4);
  EXPECT_EQ(x, 4.0f);
  EXPECT_EQ(bytes[body + 36], 3);
  int32_t last = 0;
  std::memcpy(&last, bytes.data() + bytes.size() - 4, 4);
  EXPECT_EQ(last, 2);
  EXPECT_EQ(ply_bytes({{1, 2, 3}}, {}).find("face"), std::string::npos);
}

}  // namespace
}  // namespace restage
