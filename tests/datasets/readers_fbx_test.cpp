// FBX by its name and its first bytes; what the document holds is in tests/cli/test_fbx.py.
#include "datasets/readers/fbx.h"

#include <gtest/gtest.h>

#include "autograd/base/error.h"
#include "datasets/readers/gltf.h"
#include "datasets/readers/mesh_io.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersFbx = FileTest;

/// A triangle, z up, in inches.
const char* kTriangle = R"(; FBX 7.4.0 project file
FBXHeaderExtension: { FBXHeaderVersion: 1003
 FBXVersion: 7400
}
GlobalSettings: { Version: 1000
 Properties70: {
  P: "UpAxis", "int", "Integer", "",2
  P: "FrontAxis", "int", "Integer", "",1
  P: "FrontAxisSign", "int", "Integer", "",-1
  P: "UnitScaleFactor", "double", "Number", "",2.54
 }
}
Objects: {
 Model: 1, "Model::Sheet", "Mesh" { Version: 232
 }
 Geometry: 2, "Geometry::Sheet", "Mesh" {
  Vertices: *9 { a: 0,0,0,10,0,0,0,0,20 }
  PolygonVertexIndex: *3 { a: 0,1,-3 }
 }
}
Connections: {
 C: "OO",1,0
 C: "OO",2,1
}
)";

TEST_F(ReadersFbx, IsKnownByItsFirstBytes) {
  EXPECT_TRUE(starts_as_fbx("Kaydara FBX Binary  "));
  EXPECT_TRUE(starts_as_fbx("; FBX 7.3.0 project file\n"));
  EXPECT_TRUE(starts_as_fbx("\xEF\xBB\xBF\n; FBX 7.3.0 project file\n"));
  EXPECT_TRUE(starts_as_fbx("FBXHeaderExtension:  {"));
  for (const char* other : {"", "  ", "; a comment", "glTF", "Kaydara", "ply\n"})
    EXPECT_FALSE(starts_as_fbx(other)) << other;
  EXPECT_TRUE(is_gltf_name("a/HERO.FBX") && is_mesh_name("hero.fbx"));
}

TEST_F(ReadersFbx, UnitsAndAxesAreOurs) {
  const std::string path = dir.write("sheet.fbx", kTriangle);
  Mesh mesh;
  try {
    mesh = read_mesh(path);
  } catch (const InputError& refused) {
    if (std::string(refused.what()).find("without Assimp") == std::string::npos) throw;
    GTEST_SKIP() << refused.what();
  }
  ASSERT_EQ(mesh.vertices.size(), 3u);
  EXPECT_LT((mesh.vertices[1] - Point(0.254f, 0, 0)).norm(), 1e-6);
  EXPECT_LT((mesh.vertices[2] - Point(0, 0.508f, 0)).norm(), 1e-6);
  EXPECT_EQ(read_gltf_bytes(path).substr(0, 4), "glTF");
}

}  // namespace
}  // namespace restage
