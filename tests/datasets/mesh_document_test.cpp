// An OBJ or PLY file as a glTF document: how it looks goes over.
#include "datasets/characters/mesh_document.h"

#include <gtest/gtest.h>

#include <cstring>

#include "datasets/characters/gltf_document.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "infer/writers/glb.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/support/files.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using namespace test;
using testing::GltfJson;
using MeshDocumentTest = FileTest;

const std::string kPng = std::string("\x89PNG\r\n\x1a\n") + "some bytes \0 of a picture";

/// A square whose two triangles have materials of their own; vertex 2 has two places in the
/// picture.
const std::string kSquare =
    "mtllib my look.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.75\n"
    "vn 0 0 2\nusemtl Skin\nf 1/1/1 2/2/1 3/3/1\nusemtl Cloth\nf 1/1 -2/4 4\n";
const std::string kLook =
    "newmtl Skin\nKd 0.1 0.2 0.3\nmap_Kd -s 1 1 1 -clamp on tex\\skin 1.png\n"
    "newmtl Cloth\nKd 1 0.5 0\nd 0.25\nKe 0 0 1\nmap_Kd missing.png\n";

struct Read {
  GltfJson root;
  std::string binary;
  template <class T>
  std::vector<T> rows(const GltfJson& accessor) const {
    const GltfJson& a = root["accessors"][accessor.get<size_t>()];
    const GltfJson& view = root["bufferViews"][a["bufferView"].get<size_t>()];
    std::vector<T> out(a["count"].get<size_t>());
    std::memcpy(static_cast<void*>(out.data()), binary.data() + view["byteOffset"].get<size_t>(),
                out.size() * sizeof(T));
    return out;
  }
};
Read read(const std::string& glb) {
  uint32_t length = 0;
  std::memcpy(&length, &glb[12], 4);
  return {GltfJson::parse(glb.substr(20, length)), glb.substr(28 + length)};
}

TEST_F(MeshDocumentTest, ObjKeepsCornersMaterialsAndPictures) {
  const std::string path = dir.write("in/square.obj", kSquare);
  dir.write("in/my look.mtl", "\xef\xbb\xbf" + kLook);  // with a mark, as Windows writes it
  dir.write("in/tex/skin 1.png", kPng);
  const auto made = mesh_document(path, 4);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->vertex, (std::vector<int32_t>{0, 1, 2, 0, 2, 3}));
  ASSERT_EQ(made->remarks.size(), 1u);
  EXPECT_NE(made->remarks[0].find("missing.png"), std::string::npos);
  const Read file = read(made->glb);
  const GltfJson& parts = file.root["meshes"][0]["primitives"];
  ASSERT_EQ(parts.size(), 2u);
  using Uv = std::array<float, 2>;
  EXPECT_EQ(file.rows<Uv>(parts[0]["attributes"]["TEXCOORD_0"]),
            (std::vector<Uv>{{0, 1}, {1, 1}, {1, 0}}));
  EXPECT_EQ(file.rows<Uv>(parts[1]["attributes"]["TEXCOORD_0"])[1], (Uv{0.25f, 0.25f}));
  EXPECT_EQ(file.rows<Point>(parts[0]["attributes"]["NORMAL"])[0], Point::UnitZ());
  EXPECT_EQ(file.rows<Point>(parts[1]["attributes"]["NORMAL"])[2], Point::UnitZ()) << "made";
  const GltfJson& skin = file.root["materials"][parts[0]["material"].get<size_t>()];
  const GltfJson& cloth = file.root["materials"][parts[1]["material"].get<size_t>()];
  EXPECT_EQ(skin["name"], "Skin");
  EXPECT_EQ(skin["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  EXPECT_EQ(cloth["name"], "Cloth");
  EXPECT_EQ(cloth["alphaMode"], "BLEND");
  EXPECT_EQ(cloth["pbrMetallicRoughness"]["baseColorFactor"][0], 1);
  EXPECT_EQ(cloth["pbrMetallicRoughness"]["baseColorFactor"][3], 0.25);
  EXPECT_EQ(cloth["emissiveFactor"], GltfJson::array({0, 0, 1}));
  const GltfJson& view =
      file.root["bufferViews"][file.root["images"][0]["bufferView"].get<size_t>()];
  EXPECT_EQ(file.binary.substr(view["byteOffset"].get<size_t>(), view["byteLength"].get<size_t>()),
            kPng);
  const Mesh mesh = gltf_mesh(parse_gltf(made->glb, path), gltf_rest(parse_gltf(made->glb, path)));
  const Mesh own = read_mesh(path);
  for (size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_EQ(mesh.vertices[v], own.vertices[static_cast<size_t>(made->vertex[v])]);
}

TEST_F(MeshDocumentTest, ColoursOfVerticesGoOver) {
  const std::string ply =
      dir.write("a.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
                "y\nproperty float z\n"
                "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
                "property list uchar int vertex_indices\nend_header\n0 0 0 255 0 188\n1 0 0 0 0 "
                "0\n0 1 0 1 2 3\n3 0 1 2\n");
  const std::string obj =
      dir.write("a.obj", "v 0 0 0 1 0 0.737\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
  for (const std::string& path : {ply, obj}) {
    const auto made = mesh_document(path, 3);
    ASSERT_TRUE(made) << path;
    const Read file = read(made->glb);
    const auto colours = file.rows<std::array<float, 4>>(
        file.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]);
    EXPECT_EQ(colours[0][0], 1);
    EXPECT_NEAR(colours[0][2], 0.5, 0.01) << "linear";
    EXPECT_EQ(colours[1], (std::array<float, 4>{0, 0, 0, 1}));
  }
}

TEST_F(MeshDocumentTest, WhatHasOnlyItsShapeIsNone) {
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_FALSE(mesh_document(dir.write("plain.obj", faces), 3));
  EXPECT_FALSE(mesh_document(dir.write("cloud.obj", "v 0 0 0\nvt 0 0\n"), 1));
  EXPECT_FALSE(mesh_document(dir.write("other.obj", "vt 0 0\n" + faces), 4)) << "other vertices";
  EXPECT_FALSE(mesh_document(dir.write("a.stl", "solid"), 0));
  for (const char* odd :
       {"f 1/9 2/0 3/-7\n", "f 1/x 2// 3/1/99999999999999\n", "usemtl\nf\nf 1\nf 1 2\n"}) {
    const auto made = mesh_document(dir.write("odd.obj", "vt 0 0\n" + faces + odd), 3);
    ASSERT_TRUE(made) << odd;
    EXPECT_NO_THROW(parse_gltf(made->glb, "odd.obj")) << odd;
  }
  EXPECT_FALSE(mesh_document(dir.write("far.obj", "vt 0 0\n" + faces + "f 1 2 9\n"), 3));
  const std::string lost = dir.write("lost.obj", "mtllib ../outside.mtl\nusemtl A\n" + faces);
  const auto made = mesh_document(lost, 3);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->remarks.size(), 1u);
}

/// Corners of one vertex stay together in motion.
TEST_F(MeshDocumentTest, ItWearsASkeletonMadeForTheFilesOwnVertices) {
  const std::string path = dir.write("square.obj", kSquare);
  const Mesh mesh = read_mesh(path);
  const auto made = mesh_document(path, 4);
  ASSERT_TRUE(made);
  SkinWeights weights = SkinWeights::Zero(4, kJoints);
  for (int v = 0; v < 4; ++v) weights(v, 5 * v) = 1;
  GlbWriter ours("ours.glb", mesh, testing::tiny_joints(), weights);
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.local[5] = Eigen::AngleAxisd(0.5, Vec3::UnitX()).toRotationMatrix();
  pose.root = testing::tiny_joints()[0];
  ours.push(pose);
  const Gltf file = parse_gltf(made->glb, path);
  GltfDocument document(made->glb, path);
  document.wear(ours.bytes(), file, nullptr, made->vertex);
  document.write(dir / "out.glb");
  const Gltf out = read_gltf(dir / "out.glb");
  const Mesh shown = gltf_mesh(out, gltf_pose(out, out.clips.at(0), 0));
  const PosedSkeleton posed = forward_kinematics(testing::tiny_joints(), pose);
  ASSERT_EQ(shown.vertices.size(), made->vertex.size());
  for (size_t v = 0; v < shown.vertices.size(); ++v) {
    const auto from = static_cast<size_t>(made->vertex[v]);
    const size_t j = 5 * from;
    const Vec3 wanted = posed.joints[j] + posed.global[j] * (mesh.vertices[from].cast<double>() -
                                                             testing::tiny_joints()[j]);
    EXPECT_LT((shown.vertices[v].cast<double>() - wanted).norm(), 1e-5) << v;
  }
}

}  // namespace
}  // namespace restage
