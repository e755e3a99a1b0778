// A target's own PLY or OBJ file with other vertices: what is not the vertices' stays.
#include "datasets/characters/mesh_template.h"

#include <gtest/gtest.h>

#include <cstring>

#include "datasets/readers/clouds/mesh_io.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using MeshTemplateTest = FileTest;

const Points kMoved = {{1, 2, 3}, {0.1f, -2, 1e-7f}, {5, 6, 7}, {8, 9, 10}};

TEST_F(MeshTemplateTest, ObjKeepsQuadsGroupsTexturesAndMaterials) {
  const std::string path = dir.write("in/hero.obj",
                                     "# by hand\nmtllib hero.mtl\no Body\nv 0 0 0 1 0 0\nv 1 0 0\n"
                                     "v 1 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\nv 0 1 0\ng front\n"
                                     "usemtl Skin\ns 1\nf 1/1/1 2/2/1 3//1 4/1\nf 1 2 -1\n");
  const auto mesh = MeshTemplate::of(path, 4);
  ASSERT_TRUE(mesh);
  EXPECT_TRUE(mesh->had_normals());
  EXPECT_EQ(mesh->with(kMoved, dir / "out"),
            "# restage, metres, y up\nmtllib ../in/hero.mtl\n# by hand\no Body\n"
            "v 1 2 3 1 0 0\nv 0.100000001 -2 1.00000001e-07\nv 5 6 7\nvt 0 0\nvt 1 0\n"
            "v 8 9 10\ng front\nusemtl Skin\ns 1\nf 1/1 2/2 3 4/1\nf 1 2 -1\n");
  const Mesh read = read_mesh(dir.write("out/a.obj", mesh->with(kMoved, dir / "out")));
  EXPECT_EQ(read.vertices, kMoved);
  EXPECT_EQ(read.faces, read_mesh(path).faces);
}

/// Four vertices with colours, float64 z before x, normals; a quad; an element of somebody's.
std::string ply(const std::string& format) {
  std::string out = "ply\nformat " + format +
                    " 1.0\ncomment mine\nelement vertex 4\nproperty double z\nproperty uchar red\n"
                    "property float x\nproperty float nx\nproperty float y\n"
                    "element face 1\nproperty list uchar int vertex_indices\nproperty uchar tag\n"
                    "element odd 1\nproperty short s\nend_header\n";
  const auto put = [&](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (format == "binary_big_endian") std::reverse(bytes, bytes + sizeof value);
    out.append(bytes, sizeof value);
  };
  if (format == "ascii")
    return out + "3 200 1 0.5 2\n3 201 1 0.5 2\n3 202 1 0.5 2\n3 203 1 0.5 2\n4 0 1 2 3 9\n-7\n";
  for (int v = 0; v < 4; ++v) {
    put(3.0);
    put(static_cast<uint8_t>(200 + v));
    put(1.0f);
    put(0.5f);
    put(2.0f);
  }
  put(uint8_t{4});
  for (int i = 0; i < 4; ++i) put(int32_t{i});
  put(uint8_t{9});
  put(int16_t{-7});
  return out;
}

TEST_F(MeshTemplateTest, PlyKeepsItsFormatColoursAndElements) {
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    const std::string path = dir.write("hero.ply", ply(format));
    const auto mesh = MeshTemplate::of(path, 4);
    ASSERT_TRUE(mesh);
    EXPECT_TRUE(mesh->had_normals());
    const std::string made = mesh->with(kMoved, dir.path());
    const Mesh read = read_mesh(dir.write("out.ply", made));
    EXPECT_EQ(read.vertices, kMoved);
    EXPECT_EQ(read.faces, read_mesh(path).faces);
    EXPECT_TRUE(is_ours(MeshFormat::ply, made.substr(0, 100)));
    EXPECT_HAS(made, "comment mine");
    EXPECT_HAS(made, "property uchar red");
    EXPECT_EQ(made.find("nx"), made.npos);
    // Nothing but the vertices and the normals is another: put back, it is the file.
    const auto again = MeshTemplate::of(dir / "out.ply", 4);
    ASSERT_TRUE(again);
    EXPECT_FALSE(again->had_normals());
    const std::string tail = ply(format).substr(ply(format).size() - 4);
    EXPECT_TRUE(made.ends_with(tail));
    for (const char colour : {'\xC8', '\xCB'})
      EXPECT_EQ(format == "ascii" || made.find(colour) != made.npos, true);
    if (format == "ascii") {
      EXPECT_HAS(made, "3 200 1 2\n");
    }
  }
}

TEST_F(MeshTemplateTest, WhatCannotBePutBack) {
  EXPECT_FALSE(MeshTemplate::of(dir.write("a.obj", "v 0 0 \\\n0\n"), 1));
  EXPECT_FALSE(MeshTemplate::of(dir.write("b.obj", "v 0 0 0\n"), 2))
      << "another number of vertices";
  EXPECT_FALSE(MeshTemplate::of(dir.write("c.glb", "glTF"), 0));
  EXPECT_FALSE(MeshTemplate::of(
      dir.write(
          "d.ply",
          "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 1\n"
          "property float x\nproperty float y\nproperty float z\nend_header\n1 0\n0 0 0\n"),
      1));
  EXPECT_FALSE(MeshTemplate::of(
      dir.write("e.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\n"
                "property int z\nend_header\n0 0 0\n"),
      1));
}

}  // namespace
}  // namespace restage
