// Files of other kinds, whatever they are called: what they are and how to convert them is said.
#include <gtest/gtest.h>

#include "datasets/importers/import.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/frame_folder.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using namespace std::string_literals;
using ReadersForeign = FileTest;

const struct {
  std::string start;   ///< of the file
  const char* ending;  ///< that such files have
  const char *what, *mend;
} kStrangers[] = {
    {"PK\x03\x04\x14\0"s, ".zip", "is a zip archive", "unzip"},
    {"\x1f\x8b\x08\0"s, ".gz", "is packed with gzip", "gunzip"},
    {"7z\xBC\xAF\x27\x1C\0\x04"s, ".7z", "is a 7z archive", "7z x"},
    {"Rar!\x1a\x07\0"s, ".rar", "is a RAR archive", "unrar"},
    {"PMX \0\0\0\x40"s, ".pmx", "is a model of MikuMikuDance", "MMD Tools"},
    {"PXR-USDC\0"s, ".usdc", "is USD", "export GLB (glTF)"},
    {"#usda 1.0\n(\n)\n", ".usda", "is USD", "export GLB (glTF)"},
    {"PK\x03\x04"s, ".usdz", "is USD", "export GLB (glTF)"},
    {"BLENDER-v300", ".blend", "is a file of Blender", "export GLB"},
    {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"s, ".max", "is a scene of 3ds Max", "export FBX there"},
    {"//Maya ASCII 2020 scene\n", ".ma", "is a scene of Maya", "export FBX there"},
    {"FOR4\0\0"s, ".mb", "is a scene of Maya", "export FBX there"},
    {"<?xml version=\"1.0\"?>\n<COLLADA>\n", ".dae", "is COLLADA", "export GLB (glTF)"}};

/// The one line with which import, retarget's source and a folder of it are answered.
void expect_told(const std::string& path, const std::string& out, const std::string& what,
                 const std::string& mend) {
  for (const std::string& said :
       {error_of([&] { import_data(path, out, {}); }), error_of([&] { open_frames(path); })}) {
    EXPECT_HAS(said, path + ": " + what);
    EXPECT_HAS(said, mend);
  }
}

TEST_F(ReadersForeign, KnownByTheirNamesAndByTheirFirstBytes) {
  for (const auto& file : kStrangers) {
    const std::string content = file.start + std::string(600, ' ');
    expect_told(dir.write("walk"s + file.ending, content), dir / "o.h5", file.what, file.mend);
    if (file.ending == ".usdz"s) continue;  // by its name alone
    for (const char* ending : {".bvh", ".glb", ".ply", ".obj", ".vrm", ".pcd", ".amc"})
      expect_told(dir.write("walk"s + ending, content), dir / "o.h5", file.what, file.mend);
  }
}

TEST_F(ReadersForeign, RecordingsOfLaboratoriesAreKnownByTheirNames) {
  const std::string xml = "<?xml version=\"1.0\"?>\n<mvnx version=\"4\">" + std::string(600, ' ');
  const std::string table =
      "Coordinates\nversion=1\nnRows=2\nendheader\ntime\tknee_angle_r\n0\t1\n";
  expect_told(dir.write("walk.mvnx", xml), dir / "o.h5", "is a recording of Xsens MVN",
              "export BVH");
  for (const char* name : {"walk.mot", "walk.sto"})
    expect_told(dir.write(name, table), dir / "o.h5", "holds angles of an OpenSim model", "TRC");
  expect_told(dir.write("walk.c3d", "\2P" + std::string(600, ' ')), dir / "o.h5", "holds markers",
              "solve a skeleton");
}

TEST_F(ReadersForeign, FbxIsReadOnlyByItsOwnName) {
  for (const char* start : {"Kaydara FBX Binary  \x1a", "; FBX 7.3.0 project file\n"}) {
    for (const char* ending : {".bvh", ".glb", ".ply", ".obj", ".vrm", ".pcd", ".amc"})
      expect_told(dir.write("walk"s + ending, start), dir / "o.h5", "is FBX under another name",
                  "rename it to .fbx");
    // The reader answers, with or without Assimp.
    const std::string own = dir.write("walk.fbx", start);
    EXPECT_HAS(error_of([&] { import_data(own, dir / "o.h5", {}); }), "GLB (glTF)");
    refuse_foreign_content(own);
  }
}

TEST_F(ReadersForeign, OthersAreNot) {
  refuse_foreign_content(dir.write("a.npz", "PK\x03\x04"), dir / "a.npz");
  refuse_foreign_kind(dir.write("a.ply", "ply\n"));
  refuse_foreign_content(dir / "is_not_there.fbx");
}

TEST_F(ReadersForeign, AFolderOfThemSaysWhatTheyAre) {
  dir.write("in/a.pmx", "PMX ");
  dir.write("in/b.pmx", "PMX ");
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "o.h5", {}); }),
             "model of MikuMikuDance");
  EXPECT_HAS(error_of([&] { open_frames(dir / "in"); }), "model of MikuMikuDance");
}

}  // namespace
}  // namespace restage
