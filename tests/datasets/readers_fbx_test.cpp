// FBX by its name and its first bytes; what the document holds is in tests/cli/test_fbx.py.
#include "datasets/readers/fbx/fbx.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "autograd/base/interrupt.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/gltf/gltf.h"
#include "tests/support/errors.h"
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

#define SKIP_WITHOUT_ASSIMP()                                                                   \
  if (refusal_of([] { fbx_as_glb(kTriangle, "sheet.fbx", nullptr); }).find("without Assimp") != \
      std::string::npos)                                                                        \
  GTEST_SKIP() << "built without Assimp"

TEST_F(ReadersFbx, UnitsAndAxesAreOurs) {
  SKIP_WITHOUT_ASSIMP();
  const std::string path = dir.write("sheet.fbx", kTriangle);
  const Mesh mesh = read_mesh(path);
  ASSERT_EQ(mesh.vertices.size(), 3u);
  EXPECT_LT((mesh.vertices[1] - Point(0.254f, 0, 0)).norm(), 1e-6);
  EXPECT_LT((mesh.vertices[2] - Point(0, 0.508f, 0)).norm(), 1e-6);
  EXPECT_EQ(read_gltf_bytes(path).substr(0, 4), "glTF");
}

/// A sheet of many vertices, which takes a second or more to read.
std::string large_sheet() {
  constexpr int kNumbers = 3'000'000;
  const std::string_view text = kTriangle, few = "*9 { a: 0,0,0,10,0,0,0,0,20 }";
  const size_t at = text.find(few);
  std::string out(text.substr(0, at));
  out += "*" + std::to_string(kNumbers) + " { a: 0.125";
  for (int i = 1; i < kNumbers; ++i) out += i % 3 == 0 ? ",0.125" : ",10.5";
  return out.append(" }").append(text.substr(at + few.size()));
}

/// Ctrl-C goes to all processes of a terminal. A process group of its own stands for the terminal.
TEST_F(ReadersFbx, AWishToStopIsNoLackOfMemory) {
  SKIP_WITHOUT_ASSIMP();
  const std::string path = dir.write("large.fbx", large_sheet());
  const pid_t reader = ::fork();
  if (reader == 0) {
    ::setpgid(0, 0);
    handle_signals();
    const StopScope scope;
    std::thread([] {
      siginfo_t info;
      while (::waitid(P_ALL, 0, &info, WEXITED | WNOHANG | WNOWAIT) != 0) ::usleep(1000);
      ::usleep(50'000);  // there is a child, which reads
      ::kill(0, SIGINT);
    }).detach();
    try {
      read_mesh(path);
    } catch (const Interrupted&) {
      ::_exit(10);
    } catch (const WorkError&) {
      ::_exit(11);
    }
    ::_exit(12);
  }
  int status = 0;
  ::waitpid(reader, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_NE(WEXITSTATUS(status), 12) << "it was read before anybody stopped it";
  EXPECT_EQ(WEXITSTATUS(status), 10);
}

}  // namespace
}  // namespace restage
